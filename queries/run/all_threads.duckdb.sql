-- From here on queries of this process run in as many threads as there are processors.
-- Takes and gives nothing.
RESET threads
