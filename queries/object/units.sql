-- The units that are known.
-- Takes nothing; gives symbol, dimension, in order.
SELECT symbol, dimension
FROM unit_of_measure
ORDER BY dimension, factor
