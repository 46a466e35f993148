-- How many rows a run wrote into each relation.
-- Takes run_id; gives one row a relation, the most first.
SELECT relation, sum(row_count) AS row_count
FROM ledger
WHERE run_id = :run_id
GROUP BY relation
ORDER BY row_count DESC, relation
