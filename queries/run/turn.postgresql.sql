-- Wait until no other transaction of a run writes, and keep others waiting until this one ends; readers go on.
-- Takes nothing; gives a row without meaning.
SELECT pg_advisory_xact_lock(1, 0)
