-- An extraction by its content, with the set of units that matchers see of it.
-- Takes content_key; gives no row or one: id, unit_set_id.
SELECT extraction.id, unit_set.id AS unit_set_id
FROM extraction
JOIN unit_set ON unit_set.extraction_id = extraction.id
WHERE extraction.content_key = :content_key
