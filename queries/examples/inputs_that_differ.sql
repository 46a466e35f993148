-- Which inputs differ between the two newest loads?
WITH newest AS (
    SELECT r.id, row_number() OVER (ORDER BY r.id DESC) AS place
    FROM run AS r
    WHERE r.kind = 'load'
)
SELECT coalesce(a.role, b.role) AS role, a.name AS newest, b.name AS before
FROM (SELECT i.* FROM run_input AS i JOIN newest AS n ON n.id = i.run_id WHERE n.place = 1) AS a
FULL JOIN (SELECT i.* FROM run_input AS i JOIN newest AS n ON n.id = i.run_id WHERE n.place = 2) AS b ON b.role = a.role
WHERE a.sha256 IS DISTINCT FROM b.sha256
ORDER BY role
