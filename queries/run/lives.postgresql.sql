-- Asked to learn whether a session lives; its locks do as long.
-- Takes nothing; gives a row.
SELECT 1 AS lives
