-- Images and what extraction finds in them.  Image coordinates are pixels (x right, y down); (0, 0) is the centre of the top-left pixel.

CREATE SEQUENCE image_id_seq;
CREATE TABLE image (
    id BIGINT PRIMARY KEY,
    sha256 TEXT NOT NULL UNIQUE,
    file_name TEXT NOT NULL,
    width INTEGER NOT NULL,
    height INTEGER NOT NULL,
    depth INTEGER NOT NULL,
    channels INTEGER NOT NULL,
    CHECK (width > 0 AND height > 0)
);
COMMENT ON TABLE image IS 'A picture, by content.';
COMMENT ON COLUMN image.id IS 'identity of the image';
COMMENT ON COLUMN image.sha256 IS 'SHA-256 of the file''s bytes, hexadecimal';
COMMENT ON COLUMN image.file_name IS 'name of the file as first given, without its folder';
COMMENT ON COLUMN image.width IS 'width, px';
COMMENT ON COLUMN image.height IS 'height, px';
COMMENT ON COLUMN image.depth IS 'bits a pixel and channel that the file has, 8 or 16';
COMMENT ON COLUMN image.channels IS 'number of channels';

-- Without keys: a checkpoint writes the last rows of tables with keys anew, whatever their size.
CREATE TABLE image_blob (
    image_id BIGINT NOT NULL,
    bytes BYTEA NOT NULL
);
COMMENT ON TABLE image_blob IS 'The bytes of an image, kept so that a run can be looked at months later.';
COMMENT ON COLUMN image_blob.image_id IS 'the image';
COMMENT ON COLUMN image_blob.bytes IS 'the file as it was read';

CREATE SEQUENCE extraction_id_seq;
CREATE TABLE extraction (
    id BIGINT PRIMARY KEY,
    image_id BIGINT NOT NULL,
    content_key TEXT NOT NULL UNIQUE,
    bits INTEGER NOT NULL,
    bits_from TEXT NOT NULL,
    parameters JSON NOT NULL,
    version TEXT NOT NULL,
    noise_sigma DOUBLE PRECISION NOT NULL,
    grey_dark REAL NOT NULL,
    grey_bright REAL NOT NULL,
    CHECK (bits_from IN ('file', 'rig', 'values'))
);
COMMENT ON TABLE extraction IS 'One extraction of arcs and regions from an image; all primitives hang on it.';
COMMENT ON COLUMN extraction.id IS 'identity of the extraction';
COMMENT ON COLUMN extraction.image_id IS 'the image';
COMMENT ON COLUMN extraction.content_key IS 'hash of image, bits, parameters and version: the same extraction is not made twice';
COMMENT ON COLUMN extraction.bits IS 'bits of image.depth that values were taken to fill: white is where all of them are set';
COMMENT ON COLUMN extraction.bits_from IS 'what said how many bits: file, rig (bits of the camera) or values (the least of 8, 10, 12, 14 and 16 that holds the greatest)';
COMMENT ON COLUMN extraction.parameters IS 'parameters, defaults included';
COMMENT ON COLUMN extraction.version IS 'version of the extraction';
COMMENT ON COLUMN extraction.noise_sigma IS 'standard deviation of the image noise found, grey levels of 0..255';
COMMENT ON COLUMN extraction.grey_dark IS 'grey level that one pixel in a hundred is below, 0..255';
COMMENT ON COLUMN extraction.grey_bright IS 'grey level that one pixel in a hundred is above, 0..255';

-- Without keys: some 25,000 rows a picture, whose keys would cost as much as all else of it.  Their numbers are
-- decimals that end well below their sigma: these pack to a third of floating-point numbers.
CREATE TABLE edge_element (
    extraction_id BIGINT NOT NULL,
    edge_element_no INTEGER NOT NULL,
    x DECIMAL(9, 2) NOT NULL,
    y DECIMAL(9, 2) NOT NULL,
    normal_x DECIMAL(9, 3) NOT NULL,
    normal_y DECIMAL(9, 3) NOT NULL,
    contrast DECIMAL(9, 1) NOT NULL,
    width DECIMAL(9, 2) NOT NULL,
    sigma DECIMAL(9, 3) NOT NULL,
    image_arc_no INTEGER
);
COMMENT ON TABLE edge_element IS 'Edge elements: facet zero-crossings with sub-pixel position; all that were linked, and loose ones that are strong enough to be evidence of a pose.';
COMMENT ON COLUMN edge_element.extraction_id IS 'the extraction';
COMMENT ON COLUMN edge_element.edge_element_no IS 'ordinal in the extraction, from 0: the elements of an arc follow each other along it';
COMMENT ON COLUMN edge_element.x IS 'x, px';
COMMENT ON COLUMN edge_element.y IS 'y, px';
COMMENT ON COLUMN edge_element.normal_x IS 'x of the unit normal, towards the bright side';
COMMENT ON COLUMN edge_element.normal_y IS 'y of the unit normal, towards the bright side';
COMMENT ON COLUMN edge_element.contrast IS 'height of the step, grey levels of 0..255';
COMMENT ON COLUMN edge_element.width IS 'width of the step, px';
COMMENT ON COLUMN edge_element.sigma IS 'standard deviation of the position along the normal, px';
COMMENT ON COLUMN edge_element.image_arc_no IS 'the image arc it belongs to; null where none';

-- Without keys, as the edge elements.
CREATE TABLE image_arc (
    extraction_id BIGINT NOT NULL,
    image_arc_no INTEGER NOT NULL,
    kind TEXT NOT NULL,
    topography TEXT NOT NULL,
    start_x REAL NOT NULL,
    start_y REAL NOT NULL,
    end_x REAL NOT NULL,
    end_y REAL NOT NULL,
    centre_x DOUBLE PRECISION,
    centre_y DOUBLE PRECISION,
    radius DOUBLE PRECISION,
    radius2 DOUBLE PRECISION,
    axis_angle DOUBLE PRECISION,
    length REAL NOT NULL,
    closed BOOLEAN NOT NULL,
    contrast REAL NOT NULL,
    width REAL NOT NULL,
    sigma REAL NOT NULL,
    residual REAL NOT NULL,
    significance REAL,
    element_count INTEGER NOT NULL,
    CHECK (kind IN ('line', 'circular', 'elliptic', 'free')),
    CHECK (topography IN ('edge', 'ridge', 'ravine'))
);
COMMENT ON TABLE image_arc IS 'Arcs of an image: fitted to linked edge elements, from first to last end with the brighter grey on the left along most of it.';
COMMENT ON COLUMN image_arc.extraction_id IS 'the extraction';
COMMENT ON COLUMN image_arc.image_arc_no IS 'ordinal in the extraction, from 0';
COMMENT ON COLUMN image_arc.kind IS 'line, circular, elliptic or free';
COMMENT ON COLUMN image_arc.topography IS 'edge, ridge or ravine; ridges and ravines are lines of greatest and least grey, such as fillets show, and have no bright side';
COMMENT ON COLUMN image_arc.start_x IS 'x of the first end, px; that of the junction where it takes part in one';
COMMENT ON COLUMN image_arc.start_y IS 'y of the first end, px';
COMMENT ON COLUMN image_arc.end_x IS 'x of the last end, px; that of the junction where it takes part in one';
COMMENT ON COLUMN image_arc.end_y IS 'y of the last end, px';
COMMENT ON COLUMN image_arc.centre_x IS 'x of the centre of a circular or elliptic arc, px';
COMMENT ON COLUMN image_arc.centre_y IS 'y of the centre, px';
COMMENT ON COLUMN image_arc.radius IS 'radius, or semi-major axis, px';
COMMENT ON COLUMN image_arc.radius2 IS 'semi-minor axis of an elliptic arc, px';
COMMENT ON COLUMN image_arc.axis_angle IS 'angle of the major axis from x towards y, rad';
COMMENT ON COLUMN image_arc.length IS 'length, px';
COMMENT ON COLUMN image_arc.closed IS 'whether it is a closed curve';
COMMENT ON COLUMN image_arc.contrast IS 'mean height of the step along it, grey levels of 0..255';
COMMENT ON COLUMN image_arc.width IS 'mean width of the step, px';
COMMENT ON COLUMN image_arc.sigma IS 'standard deviation of its lateral position, px';
COMMENT ON COLUMN image_arc.residual IS 'rms distance of its edge elements from the fitted curve, px';
COMMENT ON COLUMN image_arc.significance IS 'minus the decimal logarithm of its number of false alarms a megapixel: how many arcs as good its surroundings would show by chance; null for ridges and ravines';
COMMENT ON COLUMN image_arc.element_count IS 'number of edge elements';

-- Without keys, as the edge elements.
CREATE TABLE image_arc_quality (
    extraction_id BIGINT NOT NULL,
    image_arc_no INTEGER NOT NULL,
    name TEXT NOT NULL,
    value REAL NOT NULL
);
COMMENT ON TABLE image_arc_quality IS 'Attribute-value table of image arcs: what speaks against an arc being an edge of the object.';
COMMENT ON COLUMN image_arc_quality.extraction_id IS 'the extraction';
COMMENT ON COLUMN image_arc_quality.image_arc_no IS 'the arc';
COMMENT ON COLUMN image_arc_quality.name IS 'texture, highlight';
COMMENT ON COLUMN image_arc_quality.value IS 'how strongly, 0 to 1';

-- Without keys, as the edge elements.
CREATE TABLE image_arc_point (
    extraction_id BIGINT NOT NULL,
    image_arc_no INTEGER NOT NULL,
    point_no INTEGER NOT NULL,
    x DECIMAL(9, 3) NOT NULL,
    y DECIMAL(9, 3) NOT NULL,
    sigma DECIMAL(9, 4) NOT NULL
);
COMMENT ON TABLE image_arc_point IS 'The course of a free arc, which no formula gives: its edge elements in order, each moved across the arc to where its neighbours along it agree; from junction to junction where its ends are closed.';
COMMENT ON COLUMN image_arc_point.extraction_id IS 'the extraction';
COMMENT ON COLUMN image_arc_point.image_arc_no IS 'the arc';
COMMENT ON COLUMN image_arc_point.point_no IS 'ordinal along the arc, from 0';
COMMENT ON COLUMN image_arc_point.x IS 'x, px';
COMMENT ON COLUMN image_arc_point.y IS 'y, px';
COMMENT ON COLUMN image_arc_point.sigma IS 'standard deviation of the point across the arc, px';

-- Without keys, as the edge elements.
CREATE TABLE image_arc_covariance (
    extraction_id BIGINT NOT NULL,
    image_arc_no INTEGER NOT NULL,
    covariance DOUBLE PRECISION[] NOT NULL
);
COMMENT ON TABLE image_arc_covariance IS 'What its elements leave open of an arc.';
COMMENT ON COLUMN image_arc_covariance.extraction_id IS 'the extraction';
COMMENT ON COLUMN image_arc_covariance.image_arc_no IS 'the arc';
COMMENT ON COLUMN image_arc_covariance.covariance IS 'covariance matrix, row by row, px and rad; of a line: offset to the right at its middle, angle; of a circular arc: centre_x, centre_y, radius; of an elliptic one: centre_x, centre_y, radius, radius2, axis_angle; of a free one: its offset to the right at up to eight places, as many as the matrix has rows, evenly spaced along its course from first to last edge element';

-- Without keys, as the edge elements.
CREATE TABLE image_junction (
    extraction_id BIGINT NOT NULL,
    junction_no INTEGER NOT NULL,
    kind TEXT NOT NULL,
    x REAL NOT NULL,
    y REAL NOT NULL,
    xx REAL NOT NULL,
    xy REAL NOT NULL,
    yy REAL NOT NULL,
    CHECK (kind IN ('L', 'T', 'Y', 'X', 'smooth')),
    CHECK (xx > 0 AND yy > 0 AND xx * yy > xy * xy)
);
COMMENT ON TABLE image_junction IS 'Places where arcs of an image meet; the arcs'' ends are closed there.';
COMMENT ON COLUMN image_junction.extraction_id IS 'the extraction';
COMMENT ON COLUMN image_junction.junction_no IS 'ordinal in the extraction, from 0';
COMMENT ON COLUMN image_junction.kind IS 'L (two ends), T (three ways, two of which run on into each other), Y (other three), X (four ways or more), smooth (two ends that run on into each other)';
COMMENT ON COLUMN image_junction.x IS 'x, px';
COMMENT ON COLUMN image_junction.y IS 'y, px';
COMMENT ON COLUMN image_junction.xx IS 'variance of x, px^2';
COMMENT ON COLUMN image_junction.xy IS 'covariance of x and y, px^2';
COMMENT ON COLUMN image_junction.yy IS 'variance of y, px^2';

-- Without keys, as the edge elements.
CREATE TABLE image_junction_arc (
    extraction_id BIGINT NOT NULL,
    junction_no INTEGER NOT NULL,
    image_arc_no INTEGER NOT NULL,
    meets_with TEXT NOT NULL,
    CHECK (meets_with IN ('start', 'end', 'interior'))
);
COMMENT ON TABLE image_junction_arc IS 'The arcs that meet in a junction.';
COMMENT ON COLUMN image_junction_arc.extraction_id IS 'the extraction';
COMMENT ON COLUMN image_junction_arc.junction_no IS 'the junction';
COMMENT ON COLUMN image_junction_arc.image_arc_no IS 'the arc';
COMMENT ON COLUMN image_junction_arc.meets_with IS 'what of the arc lies there: start, end or its interior';

-- Without keys, as the edge elements.
CREATE TABLE image_region (
    extraction_id BIGINT NOT NULL,
    region_no INTEGER NOT NULL,
    area DOUBLE PRECISION NOT NULL,
    centroid_x REAL NOT NULL,
    centroid_y REAL NOT NULL,
    x0 REAL NOT NULL,
    y0 REAL NOT NULL,
    x1 REAL NOT NULL,
    y1 REAL NOT NULL,
    mean REAL NOT NULL,
    variance REAL NOT NULL,
    slope_x REAL NOT NULL,
    slope_y REAL NOT NULL,
    saturated_share REAL NOT NULL,
    hole_count INTEGER NOT NULL
);
COMMENT ON TABLE image_region IS 'Regions of an image: connected sets of pixels that edges enclose.';
COMMENT ON COLUMN image_region.extraction_id IS 'the extraction';
COMMENT ON COLUMN image_region.region_no IS 'ordinal in the extraction, from 0';
COMMENT ON COLUMN image_region.area IS 'area, px';
COMMENT ON COLUMN image_region.centroid_x IS 'x of the centroid, px';
COMMENT ON COLUMN image_region.centroid_y IS 'y of the centroid, px';
COMMENT ON COLUMN image_region.x0 IS 'least x, px';
COMMENT ON COLUMN image_region.y0 IS 'least y, px';
COMMENT ON COLUMN image_region.x1 IS 'greatest x, px';
COMMENT ON COLUMN image_region.y1 IS 'greatest y, px';
COMMENT ON COLUMN image_region.mean IS 'mean grey, 0..255';
COMMENT ON COLUMN image_region.variance IS 'variance of the grey about its plane';
COMMENT ON COLUMN image_region.slope_x IS 'slope of the grey plane along x, grey levels a pixel';
COMMENT ON COLUMN image_region.slope_y IS 'slope of the grey plane along y, grey levels a pixel';
COMMENT ON COLUMN image_region.saturated_share IS 'share of saturated pixels';
COMMENT ON COLUMN image_region.hole_count IS 'number of holes';

-- Without keys, as the edge elements.
CREATE TABLE region_outline (
    extraction_id BIGINT NOT NULL,
    region_no INTEGER NOT NULL,
    ring_no INTEGER NOT NULL,
    point_no INTEGER NOT NULL,
    x INTEGER NOT NULL,
    y INTEGER NOT NULL
);
COMMENT ON TABLE region_outline IS 'Outlines of the regions: corners of closed polygons.';
COMMENT ON COLUMN region_outline.extraction_id IS 'the extraction';
COMMENT ON COLUMN region_outline.region_no IS 'the region';
COMMENT ON COLUMN region_outline.ring_no IS '0 for the outer ring, then the holes';
COMMENT ON COLUMN region_outline.point_no IS 'ordinal along the ring, from 0';
COMMENT ON COLUMN region_outline.x IS 'x, px';
COMMENT ON COLUMN region_outline.y IS 'y, px';

-- Without keys, as the edge elements.
CREATE TABLE region_arc (
    extraction_id BIGINT NOT NULL,
    region_no INTEGER NOT NULL,
    image_arc_no INTEGER NOT NULL,
    side TEXT NOT NULL,
    length REAL NOT NULL,
    CHECK (side IN ('left', 'right'))
);
COMMENT ON TABLE region_arc IS 'The arcs that bound a region.';
COMMENT ON COLUMN region_arc.extraction_id IS 'the extraction';
COMMENT ON COLUMN region_arc.region_no IS 'the region';
COMMENT ON COLUMN region_arc.image_arc_no IS 'the arc';
COMMENT ON COLUMN region_arc.side IS 'side of the arc on which the region lies, walking from first to last end: left or right';
COMMENT ON COLUMN region_arc.length IS 'length of arc that borders the region, px';

-- Without keys, as the edge elements.
CREATE TABLE region_topography (
    extraction_id BIGINT NOT NULL,
    region_no INTEGER NOT NULL,
    label TEXT NOT NULL,
    pixels INTEGER NOT NULL,
    CHECK (label IN ('peak', 'pit', 'saddle', 'ridge', 'ravine', 'flat', 'slope', 'convex', 'concave', 'saddle_hill', 'inflection'))
);
COMMENT ON TABLE region_topography IS 'How many pixels of a region carry each topographic label.';
COMMENT ON COLUMN region_topography.extraction_id IS 'the extraction';
COMMENT ON COLUMN region_topography.region_no IS 'the region';
COMMENT ON COLUMN region_topography.label IS 'peak, pit, saddle, ridge, ravine, flat, slope, convex, concave, saddle_hill or inflection';
COMMENT ON COLUMN region_topography.pixels IS 'number of pixels';

INSERT INTO sds_relation (relation, level, standing) VALUES
    ('image', 'image', 'primary'),
    ('image_blob', 'image', 'primary'),
    ('extraction', 'image', 'primary'),
    ('edge_element', 'image', 'primary'),
    ('image_arc', 'image', 'primary'),
    ('image_arc_quality', 'image', 'primary'),
    ('image_arc_point', 'image', 'primary'),
    ('image_arc_covariance', 'image', 'primary'),
    ('image_junction', 'image', 'primary'),
    ('image_junction_arc', 'image', 'primary'),
    ('image_region', 'image', 'primary'),
    ('region_outline', 'image', 'primary'),
    ('region_arc', 'image', 'primary'),
    ('region_topography', 'image', 'primary');

INSERT INTO sds_reference (relation, reference_no, column_names, parent, parent_columns) VALUES
    ('extraction', 0, ARRAY['image_id'], 'image', ARRAY['id']);
