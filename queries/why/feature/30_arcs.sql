-- What became of the edges and outlines of a part in the pictures, by camera and rule, the longest first.
-- Takes run and path; gives sentence.
SELECT concat('of it in the ', camera, ' picture ', count(*), ' edges and outlines (',
    CAST(sum(length) AS NUMERIC(18, 0)), ' px) are ', CASE rule
        WHEN 'matched' THEN 'matched'
        WHEN 'no_candidate' THEN 'without any image arc near'
        ELSE concat('unmatched although image arcs were near: ', rule)
    END) AS sentence
FROM why_view_arc
WHERE run_id = :run AND path = :path
GROUP BY camera, rule
ORDER BY camera, sum(length) DESC, rule
