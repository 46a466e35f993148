-- Bounds how long each statement of the transaction may take, ms.
SELECT pg_catalog.set_config('statement_timeout', :milliseconds, true)
