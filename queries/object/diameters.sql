-- Diameters of an object of a world that have two limits.
-- Takes world and object (its name there); gives one row a diameter: path and what in one, nominal value, tolerance, mm.
SELECT path || ' ' || what AS size, nominal, upper_limit - lower_limit AS tolerance
FROM characteristic
WHERE world = :world AND object = :object AND right(what, 8) = 'diameter' AND upper_limit > lower_limit
ORDER BY number
