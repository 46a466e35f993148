-- Images and what extraction finds in them.  Image coordinates are pixels (x right, y down); (0, 0) is the centre of the top-left pixel.

CREATE SEQUENCE image_id_seq;
CREATE TABLE image (  -- image: A picture, by content.
    id BIGINT PRIMARY KEY,  -- identity of the image
    sha256 TEXT NOT NULL UNIQUE,  -- SHA-256 of the file's bytes, hexadecimal
    file_name TEXT NOT NULL,  -- name of the file as first given, without its folder
    orientation INTEGER,  -- EXIF orientation, 2 to 8, by which what the file stores was turned; null where it is taken as it is
    width INTEGER NOT NULL,  -- width when turned, px
    height INTEGER NOT NULL,  -- height when turned, px
    depth INTEGER NOT NULL,  -- bits a pixel and channel that the file has, 8 or 16
    CHECK (width > 0 AND height > 0)
);

-- Without keys: a checkpoint rewrites the last rows of tables with keys, whatever their size.
CREATE TABLE image_blob (  -- image: The bytes of an image, kept so that a run can be looked at months later.
    image_id BIGINT NOT NULL,  -- the image
    bytes BYTEA NOT NULL  -- the file as it was read
);

CREATE SEQUENCE extraction_id_seq;
CREATE TABLE extraction (  -- image: One extraction of arcs and regions from an image; all primitives refer to it.
    id BIGINT PRIMARY KEY,  -- identity of the extraction
    image_id BIGINT NOT NULL,  -- REFERENCES image (id): the image
    content_key TEXT NOT NULL UNIQUE,  -- hash of image, bits, parameters and version: the same extraction is not made twice
    bits INTEGER NOT NULL,  -- bits of image.depth that values were taken to fill: white is where all of them are set
    bits_from TEXT NOT NULL,  -- what said how many bits: file, rig (bits of the camera) or values (the least of 8, 10, 12, 14 and 16 that holds the greatest)
    parameters JSON NOT NULL,  -- parameters, defaults included
    version TEXT NOT NULL,  -- version of the extraction
    grey_dark REAL NOT NULL,  -- grey level that one pixel in a hundred is below, 0..255
    grey_bright REAL NOT NULL,  -- grey level that one pixel in a hundred is above, 0..255
    CHECK (bits_from IN ('file', 'rig', 'values'))
);

-- Without keys: some 25,000 rows a picture, whose keys would cost as much as all else of it.  Their numbers are
-- decimals that end well below their sigma: these pack to a third of floating-point numbers.
CREATE TABLE edge_element (  -- image: Edge elements: facet zero-crossings with sub-pixel position; all that were linked, and loose ones that are strong
    -- enough to be evidence of a pose.
    extraction_id BIGINT NOT NULL,  -- the extraction
    edge_element_no INTEGER NOT NULL,  -- ordinal in the extraction, from 0: the elements of an arc follow each other along it
    x DECIMAL(9, 2) NOT NULL, y DECIMAL(9, 2) NOT NULL,  -- x and y, px
    normal_x DECIMAL(9, 3) NOT NULL, normal_y DECIMAL(9, 3) NOT NULL,  -- x and y of the unit normal, towards the bright side
    contrast DECIMAL(9, 1) NOT NULL,  -- height of the step, grey levels of 0..255
    width DECIMAL(9, 2) NOT NULL,  -- width of the step, px
    sigma DECIMAL(9, 3) NOT NULL,  -- standard deviation of the position along the normal, px
    image_arc_no INTEGER  -- the image arc it belongs to; null where none
);

-- Without keys, as the edge elements.
CREATE TABLE image_arc (  -- image: Arcs of an image: fitted to linked edge elements, from first to last end with the brighter grey on the left along most of
    -- it.
    extraction_id BIGINT NOT NULL,  -- the extraction
    image_arc_no INTEGER NOT NULL,  -- ordinal in the extraction, from 0
    kind TEXT NOT NULL,  -- line, circular, elliptic or free
    topography TEXT NOT NULL,  -- edge, ridge or ravine; ridges and ravines are lines of greatest and least grey, such as fillets show, and have no
        -- bright side
    start_x REAL NOT NULL,  -- x of the first end, px; that of the junction where it takes part in one
    start_y REAL NOT NULL,  -- y of the first end, px
    end_x REAL NOT NULL,  -- x of the last end, px; that of the junction where it takes part in one
    end_y REAL NOT NULL,  -- y of the last end, px
    centre_x DOUBLE PRECISION,  -- x of the centre of a circular or elliptic arc, px
    centre_y DOUBLE PRECISION,  -- y of the centre, px
    radius DOUBLE PRECISION,  -- radius, or semi-major axis, px
    radius2 DOUBLE PRECISION,  -- semi-minor axis of an elliptic arc, px
    axis_angle DOUBLE PRECISION,  -- angle of the major axis from x towards y, rad
    length REAL NOT NULL,  -- length, px
    closed BOOLEAN NOT NULL,  -- whether it is a closed curve
    contrast REAL NOT NULL,  -- mean height of the step along it, grey levels of 0..255
    width REAL NOT NULL,  -- mean width of the step, px
    sigma REAL NOT NULL,  -- standard deviation of its lateral position, px
    residual REAL NOT NULL,  -- rms distance of its edge elements from the fitted curve, px
    significance REAL,  -- minus the decimal logarithm of its number of false alarms a megapixel: how many arcs as good its surroundings would show by
        -- chance; null for ridges and ravines
    texture REAL NOT NULL,  -- what speaks against it being an edge of the object: probability of brush texture or shading; 0 where little
    highlight REAL NOT NULL,  -- likewise: share of it along saturated grey; 0 where little
    element_count INTEGER NOT NULL,  -- number of edge elements
    CHECK (kind IN ('line', 'circular', 'elliptic', 'free')),
    CHECK (topography IN ('edge', 'ridge', 'ravine'))
);

-- Without keys, as the edge elements.
CREATE TABLE image_arc_point (  -- image: The course of a free arc, which no formula gives: its edge elements in order, each moved across the arc to where
    -- its neighbours along it agree; from junction to junction where its ends are closed.
    extraction_id BIGINT NOT NULL,  -- the extraction
    image_arc_no INTEGER NOT NULL,  -- the arc
    point_no INTEGER NOT NULL,  -- ordinal along the arc, from 0
    x DECIMAL(9, 3) NOT NULL, y DECIMAL(9, 3) NOT NULL,  -- x and y, px
    sigma DECIMAL(9, 4) NOT NULL  -- standard deviation of the point across the arc, px
);

-- Without keys, as the edge elements.
CREATE TABLE image_junction (  -- image: Places where arcs of an image meet; the arcs' ends are closed there.
    extraction_id BIGINT NOT NULL,  -- the extraction
    junction_no INTEGER NOT NULL,  -- ordinal in the extraction, from 0
    kind TEXT NOT NULL,  -- L (two ends), T (three ways, two of which run on into each other), Y (other three), X (four ways or more), smooth (two
        -- ends that run on into each other)
    x REAL NOT NULL, y REAL NOT NULL,  -- x and y, px
    xx REAL NOT NULL,  -- variance of x, px^2
    xy REAL NOT NULL,  -- covariance of x and y, px^2
    yy REAL NOT NULL,  -- variance of y, px^2
    CHECK (kind IN ('L', 'T', 'Y', 'X', 'smooth')),
    CHECK (xx > 0 AND yy > 0 AND xx * yy > xy * xy)
);

-- Without keys, as the edge elements.
CREATE TABLE image_junction_arc (  -- image: The arcs that meet in a junction.
    extraction_id BIGINT NOT NULL,  -- the extraction
    junction_no INTEGER NOT NULL,  -- the junction
    image_arc_no INTEGER NOT NULL,  -- the arc
    meets_with TEXT NOT NULL,  -- what of the arc lies there: start, end or its interior
    CHECK (meets_with IN ('start', 'end', 'interior'))
);

-- Without keys, as the edge elements.
CREATE TABLE image_region (  -- image: Regions of an image: connected sets of pixels that edges enclose.
    extraction_id BIGINT NOT NULL,  -- the extraction
    region_no INTEGER NOT NULL,  -- ordinal in the extraction, from 0
    area DOUBLE PRECISION NOT NULL,  -- area, px
    centroid_x REAL NOT NULL, centroid_y REAL NOT NULL,  -- x and y of the centroid, px
    x0 REAL NOT NULL, y0 REAL NOT NULL,  -- least x and y, px
    x1 REAL NOT NULL, y1 REAL NOT NULL,  -- greatest x and y, px
    mean REAL NOT NULL,  -- mean grey, 0..255
    variance REAL NOT NULL,  -- variance of the grey about its plane
    slope_x REAL NOT NULL, slope_y REAL NOT NULL,  -- slope of the grey plane along x and y, grey levels a pixel
    saturated_share REAL NOT NULL  -- share of saturated pixels
);

-- Without keys, as the edge elements.
CREATE TABLE region_outline (  -- image: Outlines of the regions: corners of closed polygons.
    extraction_id BIGINT NOT NULL,  -- the extraction
    region_no INTEGER NOT NULL,  -- the region
    ring_no INTEGER NOT NULL,  -- 0 for the outer ring, then the holes
    point_no INTEGER NOT NULL,  -- ordinal along the ring, from 0
    x INTEGER NOT NULL, y INTEGER NOT NULL  -- x and y, px
);

-- Without keys, as the edge elements.
CREATE TABLE region_arc (  -- image: The arcs that bound a region.
    extraction_id BIGINT NOT NULL,  -- the extraction
    region_no INTEGER NOT NULL,  -- the region
    image_arc_no INTEGER NOT NULL,  -- the arc
    side TEXT NOT NULL,  -- side of the arc on which the region lies, walking from first to last end: left or right
    length REAL NOT NULL,  -- length of arc that borders the region, px
    CHECK (side IN ('left', 'right'))
);
