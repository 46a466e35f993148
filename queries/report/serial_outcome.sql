-- How a physical part is by all inspections of it.
-- Takes serial; gives no row or one.
SELECT *
FROM serial_outcome
WHERE serial = :serial
