-- Which steps of inspections take the time, and what share of it?
SELECT e.name AS step, count(*) AS runs, sum(e.seconds) AS seconds,
    sum(e.seconds) / sum(sum(e.seconds)) OVER () AS share
FROM run_event AS e
JOIN run AS r ON r.id = e.run_id
WHERE r.kind = 'inspect' AND e.kind = 'step'
GROUP BY e.name
ORDER BY seconds DESC
