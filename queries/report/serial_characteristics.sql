-- The characteristics of a physical part, each by the stop whose state of it counts, else by the newest that measured it.
-- Takes serial; gives the columns of result/characteristic.
SELECT number, path, what, nominal, lower_limit, upper_limit, source, state, measured, deviation, expanded_uncertainty, decision, reason
FROM (
    SELECT c.*, row_number() OVER (PARTITION BY c.object_no, c.number
        ORDER BY CASE WHEN c.measured IS NULL THEN 2 WHEN c.run_id = s.run_id THEN 0 ELSE 1 END, c.run_id DESC) AS place
    FROM characteristic_result AS c
    JOIN inspection AS i ON i.run_id = c.run_id AND i.serial = :serial AND i.verdict = 'accepted'
    LEFT JOIN serial_evidence AS s ON s.serial = i.serial AND s.path = c.path
) AS stop
WHERE place = 1
ORDER BY object_no, number
