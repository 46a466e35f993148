-- Which features lie in a box of the world (x0, y0, z0, x1, y1, z1 in mm)?
SELECT path, feature_no, name, x0, y0, z0, x1, y1, z1
FROM features_in_box(
    1800 /* x0 */, -500 /* y0 */, 900 /* z0 */, 2000 /* x1 */, -400 /* y1 */, 1100 /* z1 */, 'demo_cell' /* world */
)
ORDER BY path, feature_no
