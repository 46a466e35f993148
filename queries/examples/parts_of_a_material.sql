-- Which parts are of a material?
SELECT number, name, material
FROM part
WHERE lower(material) LIKE '%7075%'
ORDER BY number, name
