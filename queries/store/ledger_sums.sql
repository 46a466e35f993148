-- Rows that runs committed into each relation that runs write, by the ledger.
-- Takes nothing; gives relation and row_count.
SELECT s.relation, coalesce(sum(l.row_count), 0) AS row_count
FROM sds_relation AS s
LEFT JOIN ledger AS l ON l.relation = s.relation
WHERE s.standing <> 'view'
    AND s.level <> 'catalogue' AND s.relation NOT IN ('run', 'run_input', 'run_event', 'ledger')
GROUP BY s.relation
ORDER BY s.relation
