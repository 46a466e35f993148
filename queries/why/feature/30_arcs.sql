-- What became of the edges and outlines of a part in the pictures, by camera and rule, the longest first.
-- Takes run and path; gives sentence.
SELECT concat('of it in the ', camera, ' picture ', count(*), ' edges and outlines (',
    CAST(sum(length) AS NUMERIC(18, 0)), ' px) are ', CASE rule
        WHEN 'missing' THEN 'missing, though such edges show'
        WHEN 'faint' THEN 'not found, which tells nothing'
        WHEN 'crowded' THEN 'too near to others or to the border'
        WHEN 'blend' THEN 'blends'
        WHEN 'unseen' THEN 'not looked for'
        ELSE 'found'
    END) AS sentence
FROM why_view_arc
WHERE run_id = :run AND path = :path
GROUP BY camera, rule
ORDER BY camera, sum(length) DESC, rule
