-- The newest run of the store.
-- Takes nothing; gives run, 0 where there is none.
SELECT coalesce(max(id), 0) AS run
FROM run
