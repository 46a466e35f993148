-- Keeps the process's statements from other files, from the network and from extensions.
-- Takes nothing; gives nothing.
SET enable_external_access = false
