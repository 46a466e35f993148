-- From here on queries of this process run in as many threads as there are processors.
-- Takes nothing; gives nothing.
RESET threads
