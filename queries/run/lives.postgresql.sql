-- Answers while a session lives, and its locks with it.
-- Takes nothing; gives a row.
SELECT 1 AS lives
