-- The constellation that the pose rests on: which circles that stereo puts in space lie on circles of the model there.
-- Takes run; gives sentence.
WITH seen AS (
    SELECT t.unit_no, sqrt(t.major_x * t.major_x + t.major_y * t.major_y + t.major_z * t.major_z) AS radius,
        p.m00 * t.centre_x + p.m01 * t.centre_y + p.m02 * t.centre_z + p.m03 AS x,
        p.m10 * t.centre_x + p.m11 * t.centre_y + p.m12 * t.centre_z + p.m13 AS y,
        p.m20 * t.centre_x + p.m21 * t.centre_y + p.m22 * t.centre_z + p.m23 AS z
    FROM triangulated_unit AS t
    JOIN pose AS p ON p.run_id = t.run_id AND p.covariance IS NOT NULL
    WHERE t.run_id = :run AND t.curve IN ('circle', 'ellipse')
),
model AS (
    SELECT c.radius,
        w.m00 * c.x + w.m01 * c.y + w.m02 * c.z + w.m03 AS x,
        w.m10 * c.x + w.m11 * c.y + w.m12 * c.z + w.m13 AS y,
        w.m20 * c.x + w.m21 * c.y + w.m22 * c.z + w.m23 AS z
    FROM inspection AS i
    JOIN world_object AS w ON w.world_id = i.world_id AND w.role = 'inspected'
    JOIN circle AS c ON c.object_id = w.object_id
    WHERE i.run_id = :run
),
-- As alike as pairs of circles have to be in the join: 1 mm and 5 percent of the radius, and 4 mm apart.
met AS (
    SELECT s.unit_no, m.radius,
        sqrt(power(m.x - s.x, 2) + power(m.y - s.y, 2) + power(m.z - s.z, 2)) AS apart
    FROM seen AS s
    JOIN model AS m ON abs(m.radius - s.radius) <= 1 + 0.05 * s.radius
        AND abs(m.x - s.x) <= 4 AND abs(m.y - s.y) <= 4 AND abs(m.z - s.z) <= 4
),
nearest AS (
    SELECT unit_no, radius, apart, row_number() OVER (PARTITION BY unit_no ORDER BY apart, radius) AS place
    FROM met
),
size AS (
    SELECT CAST(radius AS NUMERIC(18, 1)) AS radius, count(*) AS circles, avg(apart) AS apart
    FROM nearest
    WHERE place = 1
    GROUP BY 1
)
SELECT concat(CAST(sum(circles) AS INTEGER), ' of ', (SELECT count(*) FROM seen),
    ' circles that stereo puts in space lie on circles of the model, ',
    CAST(sum(apart * circles) / sum(circles) AS NUMERIC(18, 2)), ' mm apart in the mean: ',
    string_agg(concat(circles, ' of radius ', radius), ', ' ORDER BY radius DESC)) AS sentence
FROM size
HAVING count(*) > 0
