-- The units that are known.
-- Takes nothing; gives symbol, dimension and factor (how many of the store's own unit it is), in order.
SELECT symbol, dimension, factor
FROM unit_of_measure
ORDER BY dimension, factor
