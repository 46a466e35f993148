-- What an extraction says of its whole picture.
-- Takes extraction_id; gives rows, columns, grey_dark, grey_bright.
SELECT i.height AS rows, i.width AS columns, CAST(e.grey_dark AS DOUBLE PRECISION) AS grey_dark,
    CAST(e.grey_bright AS DOUBLE PRECISION) AS grey_bright
FROM extraction AS e
JOIN image AS i ON i.id = e.image_id
WHERE e.id = :extraction_id
