-- From here on all queries of this process run in one thread.
-- Takes nothing; gives nothing.
SET threads = 1
