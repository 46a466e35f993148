-- Bounds how long each statement of the transaction may take.
-- Takes milliseconds; gives one value.
SELECT pg_catalog.set_config('statement_timeout', :milliseconds, true)
