-- Level surface/arc: functions over bounded domains, addressed by their content, in the frame of the shape that lists them.
-- Parameterisation, with Y = Z x X (negated where not direct) and e(u) = cos u X + sin u Y:
--   plane O + u X + v Y; cylinder O + R e(u) + v Z; cone O + (R + v sin a) e(u) + v cos a Z;
--   sphere O + R cos v e(u) + R sin v Z; torus O + (R + r cos v) e(u) + r sin v Z; b-spline: surface_spline.
--   line O + t X; circle O + R e(t); ellipse O + R cos t X + r sin t Y;
--   parabola O + t^2/(4R) X + t Y; hyperbola O + R cosh t X + r sinh t Y; b-spline: arc_spline; offset: arc_offset.

CREATE SEQUENCE arc_id_seq;
CREATE TABLE arc (  -- surface: A bounded curve in space, shared by all shapes that contain exactly it.
    id BIGINT PRIMARY KEY,  -- identity of the arc
    content_key TEXT NOT NULL UNIQUE,  -- hash of kind, parameters and interval: equal arcs are one row
    kind TEXT NOT NULL,  -- kind as stored in the source
    recognised_kind TEXT NOT NULL,  -- kind of the analytic curve that it is, where a spline hides one; else kind
    origin_x DOUBLE PRECISION, origin_y DOUBLE PRECISION, origin_z DOUBLE PRECISION,  -- x, y and z of the origin O of the curve's frame, mm
    axis_x_x DOUBLE PRECISION, axis_x_y DOUBLE PRECISION, axis_x_z DOUBLE PRECISION,  -- x, y and z of the unit vector X of the curve's frame; direction of a line
    axis_z_x DOUBLE PRECISION, axis_z_y DOUBLE PRECISION, axis_z_z DOUBLE PRECISION,  -- x, y and z of the unit vector Z of the curve's frame; normal of a plane curve
    radius DOUBLE PRECISION,  -- R: radius of a circle, major radius of an ellipse, focal length of a parabola, mm
    radius2 DOUBLE PRECISION,  -- r: minor radius of an ellipse or hyperbola, mm
    t0 DOUBLE PRECISION NOT NULL,  -- start of the parameter interval
    t1 DOUBLE PRECISION NOT NULL,  -- end of the parameter interval
    start_x DOUBLE PRECISION NOT NULL, start_y DOUBLE PRECISION NOT NULL, start_z DOUBLE PRECISION NOT NULL,  -- x, y and z of the point at t0, mm
    end_x DOUBLE PRECISION NOT NULL, end_y DOUBLE PRECISION NOT NULL, end_z DOUBLE PRECISION NOT NULL,  -- x, y and z of the point at t1, mm
    length DOUBLE PRECISION NOT NULL,  -- length, mm
    x0 DOUBLE PRECISION NOT NULL, y0 DOUBLE PRECISION NOT NULL, z0 DOUBLE PRECISION NOT NULL,  -- least x, y and z of the arc's bounding box in the frame of its shape, mm
    x1 DOUBLE PRECISION NOT NULL, y1 DOUBLE PRECISION NOT NULL, z1 DOUBLE PRECISION NOT NULL,  -- greatest x, y and z of the arc's bounding box in the frame of its shape, mm
    provenance TEXT NOT NULL,  -- exact (from a B-rep) or fitted (to a mesh)
    residual DOUBLE PRECISION,  -- greatest distance of what it was fitted to, mm; null where exact
    CHECK (x0 <= x1 AND y0 <= y1 AND z0 <= z1),
    CHECK (kind IN ('line', 'circle', 'ellipse', 'parabola', 'hyperbola', 'spline', 'offset', 'degenerate', 'polyline')),
    CHECK (t0 <= t1),
    CHECK (provenance IN ('exact', 'fitted'))
);

CREATE TABLE arc_spline (  -- surface: Knots and poles of the arcs of kind spline; vertices of those of kind polyline (degree 1).
    arc_id BIGINT PRIMARY KEY,  -- REFERENCES arc (id): the arc
    degree INTEGER NOT NULL,  -- degree
    periodic BOOLEAN NOT NULL,  -- whether knots and poles are periodic
    rational BOOLEAN NOT NULL,  -- whether weights differ
    knots DOUBLE PRECISION[] NOT NULL,  -- distinct knots, increasing
    multiplicities INTEGER[] NOT NULL,  -- multiplicity of each knot
    poles DOUBLE PRECISION[] NOT NULL,  -- poles, x y z after each other, mm
    weights DOUBLE PRECISION[]  -- weight of each pole; null where not rational
);

CREATE TABLE arc_offset (  -- surface: What arcs of kind offset are made from: each point of the basis moved along T x A, T being its tangent.
    arc_id BIGINT PRIMARY KEY,  -- REFERENCES arc (id): the arc
    basis_arc_id BIGINT NOT NULL,  -- REFERENCES arc (id): the curve that is offset, of equal parameter
    axis_x DOUBLE PRECISION NOT NULL, axis_y DOUBLE PRECISION NOT NULL, axis_z DOUBLE PRECISION NOT NULL,  -- x, y and z of the unit vector A
    distance DOUBLE PRECISION NOT NULL  -- offset along the unit vector of T x A, mm
);

CREATE SEQUENCE surface_id_seq;
CREATE TABLE surface (  -- surface: A bounded surface, shared by all shapes that contain exactly it.
    id BIGINT PRIMARY KEY,  -- identity of the surface
    content_key TEXT NOT NULL UNIQUE,  -- hash of kind, parameters, sense and trimming loops: equal surfaces are one row
    support_key TEXT NOT NULL,  -- hash of the unbounded surface: same support and another content is "retrimmed"
    kind TEXT NOT NULL,  -- kind as stored in the source
    recognised_kind TEXT NOT NULL,  -- kind of the analytic surface that it is, where a spline hides one; else kind
    origin_x DOUBLE PRECISION, origin_y DOUBLE PRECISION, origin_z DOUBLE PRECISION,  -- x, y and z of the origin O of the surface's frame, mm
    axis_x_x DOUBLE PRECISION, axis_x_y DOUBLE PRECISION, axis_x_z DOUBLE PRECISION,  -- x, y and z of the unit vector X of the surface's frame
    axis_z_x DOUBLE PRECISION, axis_z_y DOUBLE PRECISION, axis_z_z DOUBLE PRECISION,  -- x, y and z of the unit vector Z of the surface's frame: plane normal, axis of revolution
    direct BOOLEAN NOT NULL,  -- whether X, Y, Z is right-handed: Y = Z x X, else its negative
    radius DOUBLE PRECISION,  -- R: radius, at v = 0 for a cone, major for a torus, mm
    radius2 DOUBLE PRECISION,  -- r: minor radius of a torus, mm
    semi_angle DOUBLE PRECISION,  -- a: half angle of a cone, rad
    u0 DOUBLE PRECISION NOT NULL,  -- least u of the domain
    u1 DOUBLE PRECISION NOT NULL,  -- greatest u of the domain
    v0 DOUBLE PRECISION NOT NULL,  -- least v of the domain
    v1 DOUBLE PRECISION NOT NULL,  -- greatest v of the domain
    reversed BOOLEAN NOT NULL,  -- whether the outward normal is the negative of dS/du x dS/dv
    area DOUBLE PRECISION NOT NULL,  -- area within the trimming loops, mm2
    centroid_x DOUBLE PRECISION NOT NULL, centroid_y DOUBLE PRECISION NOT NULL, centroid_z DOUBLE PRECISION NOT NULL,  -- x, y and z of the centroid of the trimmed surface, mm
    x0 DOUBLE PRECISION NOT NULL, y0 DOUBLE PRECISION NOT NULL, z0 DOUBLE PRECISION NOT NULL,  -- least x, y and z of the trimmed surface's bounding box in the frame of its shape, mm
    x1 DOUBLE PRECISION NOT NULL, y1 DOUBLE PRECISION NOT NULL, z1 DOUBLE PRECISION NOT NULL,  -- greatest x, y and z of the trimmed surface's bounding box in the frame of its shape, mm
    provenance TEXT NOT NULL,  -- exact (from a B-rep) or fitted (to a mesh)
    residual DOUBLE PRECISION,  -- greatest distance of what it was fitted to, mm; null where exact
    CHECK (x0 <= x1 AND y0 <= y1 AND z0 <= z1),
    CHECK (kind IN ('plane', 'cylinder', 'cone', 'sphere', 'torus', 'spline', 'extrusion', 'revolution', 'offset', 'facets')),
    CHECK (provenance IN ('exact', 'fitted')),
    CHECK (area >= 0)
);

CREATE TABLE surface_spline (  -- surface: Knots and poles of the surfaces of kind spline.
    surface_id BIGINT PRIMARY KEY,  -- REFERENCES surface (id): the surface
    u_degree INTEGER NOT NULL,  -- degree in u
    v_degree INTEGER NOT NULL,  -- degree in v
    u_periodic BOOLEAN NOT NULL,  -- whether it is periodic in u
    v_periodic BOOLEAN NOT NULL,  -- whether it is periodic in v
    rational BOOLEAN NOT NULL,  -- whether weights differ
    u_knots DOUBLE PRECISION[] NOT NULL,  -- distinct knots in u, increasing
    u_multiplicities INTEGER[] NOT NULL,  -- multiplicity of each knot in u
    v_knots DOUBLE PRECISION[] NOT NULL,  -- distinct knots in v, increasing
    v_multiplicities INTEGER[] NOT NULL,  -- multiplicity of each knot in v
    u_poles INTEGER NOT NULL,  -- number of poles in u
    v_poles INTEGER NOT NULL,  -- number of poles in v
    poles DOUBLE PRECISION[] NOT NULL,  -- poles, x y z after each other, v running fastest, mm
    weights DOUBLE PRECISION[]  -- weight of each pole in the same order; null where not rational
);

CREATE TABLE surface_swept (  -- surface: What surfaces of kind extrusion, revolution and offset are made from.
    surface_id BIGINT PRIMARY KEY,  -- REFERENCES surface (id): the surface
    basis_arc_id BIGINT,  -- REFERENCES arc (id): the curve that is extruded or revolved
    basis_surface_id BIGINT,  -- REFERENCES surface (id): the surface that is offset
    axis_x DOUBLE PRECISION, axis_y DOUBLE PRECISION, axis_z DOUBLE PRECISION,  -- x, y and z of the direction of extrusion or axis of revolution, unit
    distance DOUBLE PRECISION,  -- offset along the basis surface's normal dS/du x dS/dv, mm
    CHECK ((basis_arc_id IS NULL) <> (basis_surface_id IS NULL))
);

CREATE TABLE loop (  -- surface: The closed loops of coedges that bound a surface's domain.
    surface_id BIGINT NOT NULL,  -- REFERENCES surface (id): the surface
    loop_no INTEGER NOT NULL,  -- ordinal of the loop; the outer ones come first
    outer_loop BOOLEAN NOT NULL,  -- whether the loop is the outer boundary; several where loops go around a periodic surface
    PRIMARY KEY (surface_id, loop_no)
);

CREATE TABLE coedge (  -- surface: The use of an arc by a loop; material lies to its left seen from outside.
    surface_id BIGINT NOT NULL,  -- the surface
    loop_no INTEGER NOT NULL,  -- REFERENCES loop (surface_id, loop_no): the loop
    coedge_no INTEGER NOT NULL,  -- ordinal along the loop
    arc_id BIGINT NOT NULL,  -- REFERENCES arc (id): the arc
    reversed BOOLEAN NOT NULL,  -- whether the loop runs against the arc's parameter
    tolerance DOUBLE PRECISION,  -- how far the arc may lie off the surface and end off the start of the next, mm: 0.01, or what the CAD kernel states
        -- for the edge up to 0.1 mm or 1e-4 of the shape; where loading found more (load_finding) or fitted a mesh, what it measured; null where it
        -- could not
    PRIMARY KEY (surface_id, loop_no, coedge_no),
    CHECK (tolerance > 0)
);
