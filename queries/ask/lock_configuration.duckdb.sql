-- Keeps the configuration as it is for as long as the process has the file open.
-- Takes nothing; gives nothing.
SET lock_configuration = true
