-- How many relations in space are like relations of the model, and the rarest of them.
-- Takes run; gives sentence.
WITH counted AS (
    SELECT kind, count(*) AS relations, sum(CASE WHEN alike > 0 THEN 1 ELSE 0 END) AS joined
    FROM space_relation
    WHERE run_id = :run
    GROUP BY kind
),
ranked AS (
    SELECT *, row_number() OVER (PARTITION BY kind ORDER BY alike, distance_sigma, unit_a, unit_b) AS place
    FROM space_relation
    WHERE run_id = :run AND alike > 0
)
SELECT concat(c.joined, ' of ', c.relations, ' relations of ', CASE c.kind WHEN 'lines' THEN 'straight edges' ELSE c.kind END,
    ' in space are like relations of the model; the rarest: two ',
    CASE c.kind WHEN 'lines' THEN 'straight edges'
        ELSE concat('circles of radius ', CAST(r.radius_a AS NUMERIC(18, 1)), ' and ', CAST(r.radius_b AS NUMERIC(18, 1)), ' mm') END,
    ', ', CAST(abs(r.distance) AS NUMERIC(18, 1)), ' mm apart (sigma ', CAST(r.distance_sigma AS NUMERIC(18, 2)), '), like ',
    r.alike, ' of the model') AS sentence
FROM counted AS c
JOIN ranked AS r ON r.kind = c.kind AND r.place = 1
ORDER BY c.kind
