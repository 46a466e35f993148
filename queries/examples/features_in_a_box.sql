-- Which features lie in a box of the world (x0, y0, z0, x1, y1, z1 in mm)?
SELECT path, feature_no, name, x0, y0, z0, x1, y1, z1
FROM features_in_box(1800, -500, 900, 2000, -400, 1100, 'demo_cell')
ORDER BY path, feature_no
