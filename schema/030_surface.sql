-- Level surface/arc: functions over bounded domains, addressed by their content, in the frame of the shape that lists them.
-- Parameterisation, with Y = Z x X (negated where not direct) and e(u) = cos u X + sin u Y:
--   plane O + u X + v Y; cylinder O + R e(u) + v Z; cone O + (R + v sin a) e(u) + v cos a Z;
--   sphere O + R cos v e(u) + R sin v Z; torus O + (R + r cos v) e(u) + r sin v Z; b-spline: surface_spline.
--   line O + t X; circle O + R e(t); ellipse O + R cos t X + r sin t Y;
--   parabola O + t^2/(4R) X + t Y; hyperbola O + R cosh t X + r sinh t Y; b-spline: arc_spline; offset: arc_offset.

CREATE SEQUENCE arc_id_seq;
CREATE TABLE arc (
    id BIGINT PRIMARY KEY,
    content_key TEXT NOT NULL UNIQUE,
    support_key TEXT NOT NULL,
    kind TEXT NOT NULL,
    recognised_kind TEXT NOT NULL,
    origin_x DOUBLE PRECISION,
    origin_y DOUBLE PRECISION,
    origin_z DOUBLE PRECISION,
    axis_x_x DOUBLE PRECISION,
    axis_x_y DOUBLE PRECISION,
    axis_x_z DOUBLE PRECISION,
    axis_z_x DOUBLE PRECISION,
    axis_z_y DOUBLE PRECISION,
    axis_z_z DOUBLE PRECISION,
    radius DOUBLE PRECISION,
    radius2 DOUBLE PRECISION,
    t0 DOUBLE PRECISION NOT NULL,
    t1 DOUBLE PRECISION NOT NULL,
    start_x DOUBLE PRECISION NOT NULL,
    start_y DOUBLE PRECISION NOT NULL,
    start_z DOUBLE PRECISION NOT NULL,
    end_x DOUBLE PRECISION NOT NULL,
    end_y DOUBLE PRECISION NOT NULL,
    end_z DOUBLE PRECISION NOT NULL,
    length DOUBLE PRECISION NOT NULL,
    x0 DOUBLE PRECISION NOT NULL,
    y0 DOUBLE PRECISION NOT NULL,
    z0 DOUBLE PRECISION NOT NULL,
    x1 DOUBLE PRECISION NOT NULL,
    y1 DOUBLE PRECISION NOT NULL,
    z1 DOUBLE PRECISION NOT NULL,
    provenance TEXT NOT NULL,
    residual DOUBLE PRECISION,
    CHECK (x0 <= x1 AND y0 <= y1 AND z0 <= z1),
    CHECK (kind IN ('line', 'circle', 'ellipse', 'parabola', 'hyperbola', 'spline', 'offset', 'degenerate', 'polyline')),
    CHECK (t0 <= t1),
    CHECK (provenance IN ('exact', 'fitted'))
);
COMMENT ON TABLE arc IS 'A bounded curve in space, shared by all shapes that contain exactly it.';
COMMENT ON COLUMN arc.id IS 'identity of the arc';
COMMENT ON COLUMN arc.content_key IS 'hash of kind, parameters and interval: equal arcs are one row';
COMMENT ON COLUMN arc.support_key IS 'hash of the unbounded curve that carries the arc';
COMMENT ON COLUMN arc.kind IS 'kind as stored in the source';
COMMENT ON COLUMN arc.recognised_kind IS 'kind of the analytic curve that it is, where a spline hides one; else kind';
COMMENT ON COLUMN arc.origin_x IS 'x of the origin O of the curve''s frame, mm';
COMMENT ON COLUMN arc.origin_y IS 'y of the origin O of the curve''s frame, mm';
COMMENT ON COLUMN arc.origin_z IS 'z of the origin O of the curve''s frame, mm';
COMMENT ON COLUMN arc.axis_x_x IS 'x of the unit vector X of the curve''s frame; direction of a line';
COMMENT ON COLUMN arc.axis_x_y IS 'y of the unit vector X of the curve''s frame; direction of a line';
COMMENT ON COLUMN arc.axis_x_z IS 'z of the unit vector X of the curve''s frame; direction of a line';
COMMENT ON COLUMN arc.axis_z_x IS 'x of the unit vector Z of the curve''s frame; normal of a plane curve';
COMMENT ON COLUMN arc.axis_z_y IS 'y of the unit vector Z of the curve''s frame; normal of a plane curve';
COMMENT ON COLUMN arc.axis_z_z IS 'z of the unit vector Z of the curve''s frame; normal of a plane curve';
COMMENT ON COLUMN arc.radius IS 'R: radius of a circle, major radius of an ellipse, focal length of a parabola, mm';
COMMENT ON COLUMN arc.radius2 IS 'r: minor radius of an ellipse or hyperbola, mm';
COMMENT ON COLUMN arc.t0 IS 'start of the parameter interval';
COMMENT ON COLUMN arc.t1 IS 'end of the parameter interval';
COMMENT ON COLUMN arc.start_x IS 'x of the point at t0, mm';
COMMENT ON COLUMN arc.start_y IS 'y of the point at t0, mm';
COMMENT ON COLUMN arc.start_z IS 'z of the point at t0, mm';
COMMENT ON COLUMN arc.end_x IS 'x of the point at t1, mm';
COMMENT ON COLUMN arc.end_y IS 'y of the point at t1, mm';
COMMENT ON COLUMN arc.end_z IS 'z of the point at t1, mm';
COMMENT ON COLUMN arc.length IS 'length, mm';
COMMENT ON COLUMN arc.x0 IS 'least x of the arc''s bounding box in the frame of its shape, mm';
COMMENT ON COLUMN arc.y0 IS 'least y of the arc''s bounding box in the frame of its shape, mm';
COMMENT ON COLUMN arc.z0 IS 'least z of the arc''s bounding box in the frame of its shape, mm';
COMMENT ON COLUMN arc.x1 IS 'greatest x of the arc''s bounding box in the frame of its shape, mm';
COMMENT ON COLUMN arc.y1 IS 'greatest y of the arc''s bounding box in the frame of its shape, mm';
COMMENT ON COLUMN arc.z1 IS 'greatest z of the arc''s bounding box in the frame of its shape, mm';
COMMENT ON COLUMN arc.provenance IS 'exact (from a B-rep) or fitted (to a mesh)';
COMMENT ON COLUMN arc.residual IS 'greatest distance of what it was fitted to, mm; null where exact';

CREATE TABLE arc_spline (
    arc_id BIGINT PRIMARY KEY,
    degree INTEGER NOT NULL,
    periodic BOOLEAN NOT NULL,
    rational BOOLEAN NOT NULL,
    knots DOUBLE PRECISION[] NOT NULL,
    multiplicities INTEGER[] NOT NULL,
    poles DOUBLE PRECISION[] NOT NULL,
    weights DOUBLE PRECISION[]
);
COMMENT ON TABLE arc_spline IS 'Knots and poles of the arcs of kind spline; vertices of those of kind polyline (degree 1).';
COMMENT ON COLUMN arc_spline.arc_id IS 'the arc';
COMMENT ON COLUMN arc_spline.degree IS 'degree';
COMMENT ON COLUMN arc_spline.periodic IS 'whether knots and poles are periodic';
COMMENT ON COLUMN arc_spline.rational IS 'whether weights differ';
COMMENT ON COLUMN arc_spline.knots IS 'distinct knots, increasing';
COMMENT ON COLUMN arc_spline.multiplicities IS 'multiplicity of each knot';
COMMENT ON COLUMN arc_spline.poles IS 'poles, x y z after each other, mm';
COMMENT ON COLUMN arc_spline.weights IS 'weight of each pole; null where not rational';

CREATE TABLE arc_offset (
    arc_id BIGINT PRIMARY KEY,
    basis_arc_id BIGINT NOT NULL,
    axis_x DOUBLE PRECISION NOT NULL,
    axis_y DOUBLE PRECISION NOT NULL,
    axis_z DOUBLE PRECISION NOT NULL,
    distance DOUBLE PRECISION NOT NULL
);
COMMENT ON TABLE arc_offset IS 'What arcs of kind offset are made from: each point of the basis moved along T x A, T being its tangent.';
COMMENT ON COLUMN arc_offset.arc_id IS 'the arc';
COMMENT ON COLUMN arc_offset.basis_arc_id IS 'the curve that is offset, of equal parameter';
COMMENT ON COLUMN arc_offset.axis_x IS 'x of the unit vector A';
COMMENT ON COLUMN arc_offset.axis_y IS 'y of the unit vector A';
COMMENT ON COLUMN arc_offset.axis_z IS 'z of the unit vector A';
COMMENT ON COLUMN arc_offset.distance IS 'offset along the unit vector of T x A, mm';

CREATE SEQUENCE surface_id_seq;
CREATE TABLE surface (
    id BIGINT PRIMARY KEY,
    content_key TEXT NOT NULL UNIQUE,
    support_key TEXT NOT NULL,
    kind TEXT NOT NULL,
    recognised_kind TEXT NOT NULL,
    origin_x DOUBLE PRECISION,
    origin_y DOUBLE PRECISION,
    origin_z DOUBLE PRECISION,
    axis_x_x DOUBLE PRECISION,
    axis_x_y DOUBLE PRECISION,
    axis_x_z DOUBLE PRECISION,
    axis_z_x DOUBLE PRECISION,
    axis_z_y DOUBLE PRECISION,
    axis_z_z DOUBLE PRECISION,
    direct BOOLEAN NOT NULL,
    radius DOUBLE PRECISION,
    radius2 DOUBLE PRECISION,
    semi_angle DOUBLE PRECISION,
    u0 DOUBLE PRECISION NOT NULL,
    u1 DOUBLE PRECISION NOT NULL,
    v0 DOUBLE PRECISION NOT NULL,
    v1 DOUBLE PRECISION NOT NULL,
    reversed BOOLEAN NOT NULL,
    area DOUBLE PRECISION NOT NULL,
    centroid_x DOUBLE PRECISION NOT NULL,
    centroid_y DOUBLE PRECISION NOT NULL,
    centroid_z DOUBLE PRECISION NOT NULL,
    x0 DOUBLE PRECISION NOT NULL,
    y0 DOUBLE PRECISION NOT NULL,
    z0 DOUBLE PRECISION NOT NULL,
    x1 DOUBLE PRECISION NOT NULL,
    y1 DOUBLE PRECISION NOT NULL,
    z1 DOUBLE PRECISION NOT NULL,
    provenance TEXT NOT NULL,
    residual DOUBLE PRECISION,
    CHECK (x0 <= x1 AND y0 <= y1 AND z0 <= z1),
    CHECK (kind IN ('plane', 'cylinder', 'cone', 'sphere', 'torus', 'spline', 'extrusion', 'revolution', 'offset', 'facets')),
    CHECK (provenance IN ('exact', 'fitted')),
    CHECK (area >= 0)
);
COMMENT ON TABLE surface IS 'A bounded surface, shared by all shapes that contain exactly it.';
COMMENT ON COLUMN surface.id IS 'identity of the surface';
COMMENT ON COLUMN surface.content_key IS 'hash of kind, parameters, sense and trimming loops: equal surfaces are one row';
COMMENT ON COLUMN surface.support_key IS 'hash of the unbounded surface: same support and another content is "retrimmed"';
COMMENT ON COLUMN surface.kind IS 'kind as stored in the source';
COMMENT ON COLUMN surface.recognised_kind IS 'kind of the analytic surface that it is, where a spline hides one; else kind';
COMMENT ON COLUMN surface.origin_x IS 'x of the origin O of the surface''s frame, mm';
COMMENT ON COLUMN surface.origin_y IS 'y of the origin O of the surface''s frame, mm';
COMMENT ON COLUMN surface.origin_z IS 'z of the origin O of the surface''s frame, mm';
COMMENT ON COLUMN surface.axis_x_x IS 'x of the unit vector X of the surface''s frame';
COMMENT ON COLUMN surface.axis_x_y IS 'y of the unit vector X of the surface''s frame';
COMMENT ON COLUMN surface.axis_x_z IS 'z of the unit vector X of the surface''s frame';
COMMENT ON COLUMN surface.axis_z_x IS 'x of the unit vector Z of the surface''s frame: plane normal, axis of revolution';
COMMENT ON COLUMN surface.axis_z_y IS 'y of the unit vector Z of the surface''s frame: plane normal, axis of revolution';
COMMENT ON COLUMN surface.axis_z_z IS 'z of the unit vector Z of the surface''s frame: plane normal, axis of revolution';
COMMENT ON COLUMN surface.direct IS 'whether X, Y, Z is right-handed: Y = Z x X, else its negative';
COMMENT ON COLUMN surface.radius IS 'R: radius, at v = 0 for a cone, major for a torus, mm';
COMMENT ON COLUMN surface.radius2 IS 'r: minor radius of a torus, mm';
COMMENT ON COLUMN surface.semi_angle IS 'a: half angle of a cone, rad';
COMMENT ON COLUMN surface.u0 IS 'least u of the domain';
COMMENT ON COLUMN surface.u1 IS 'greatest u of the domain';
COMMENT ON COLUMN surface.v0 IS 'least v of the domain';
COMMENT ON COLUMN surface.v1 IS 'greatest v of the domain';
COMMENT ON COLUMN surface.reversed IS 'whether the outward normal is the negative of dS/du x dS/dv';
COMMENT ON COLUMN surface.area IS 'area within the trimming loops, mm2';
COMMENT ON COLUMN surface.centroid_x IS 'x of the centroid of the trimmed surface, mm';
COMMENT ON COLUMN surface.centroid_y IS 'y of the centroid of the trimmed surface, mm';
COMMENT ON COLUMN surface.centroid_z IS 'z of the centroid of the trimmed surface, mm';
COMMENT ON COLUMN surface.x0 IS 'least x of the trimmed surface''s bounding box in the frame of its shape, mm';
COMMENT ON COLUMN surface.y0 IS 'least y of the trimmed surface''s bounding box in the frame of its shape, mm';
COMMENT ON COLUMN surface.z0 IS 'least z of the trimmed surface''s bounding box in the frame of its shape, mm';
COMMENT ON COLUMN surface.x1 IS 'greatest x of the trimmed surface''s bounding box in the frame of its shape, mm';
COMMENT ON COLUMN surface.y1 IS 'greatest y of the trimmed surface''s bounding box in the frame of its shape, mm';
COMMENT ON COLUMN surface.z1 IS 'greatest z of the trimmed surface''s bounding box in the frame of its shape, mm';
COMMENT ON COLUMN surface.provenance IS 'exact (from a B-rep) or fitted (to a mesh)';
COMMENT ON COLUMN surface.residual IS 'greatest distance of what it was fitted to, mm; null where exact';

CREATE TABLE surface_spline (
    surface_id BIGINT PRIMARY KEY,
    u_degree INTEGER NOT NULL,
    v_degree INTEGER NOT NULL,
    u_periodic BOOLEAN NOT NULL,
    v_periodic BOOLEAN NOT NULL,
    rational BOOLEAN NOT NULL,
    u_knots DOUBLE PRECISION[] NOT NULL,
    u_multiplicities INTEGER[] NOT NULL,
    v_knots DOUBLE PRECISION[] NOT NULL,
    v_multiplicities INTEGER[] NOT NULL,
    u_poles INTEGER NOT NULL,
    v_poles INTEGER NOT NULL,
    poles DOUBLE PRECISION[] NOT NULL,
    weights DOUBLE PRECISION[]
);
COMMENT ON TABLE surface_spline IS 'Knots and poles of the surfaces of kind spline.';
COMMENT ON COLUMN surface_spline.surface_id IS 'the surface';
COMMENT ON COLUMN surface_spline.u_degree IS 'degree in u';
COMMENT ON COLUMN surface_spline.v_degree IS 'degree in v';
COMMENT ON COLUMN surface_spline.u_periodic IS 'whether it is periodic in u';
COMMENT ON COLUMN surface_spline.v_periodic IS 'whether it is periodic in v';
COMMENT ON COLUMN surface_spline.rational IS 'whether weights differ';
COMMENT ON COLUMN surface_spline.u_knots IS 'distinct knots in u, increasing';
COMMENT ON COLUMN surface_spline.u_multiplicities IS 'multiplicity of each knot in u';
COMMENT ON COLUMN surface_spline.v_knots IS 'distinct knots in v, increasing';
COMMENT ON COLUMN surface_spline.v_multiplicities IS 'multiplicity of each knot in v';
COMMENT ON COLUMN surface_spline.u_poles IS 'number of poles in u';
COMMENT ON COLUMN surface_spline.v_poles IS 'number of poles in v';
COMMENT ON COLUMN surface_spline.poles IS 'poles, x y z after each other, v running fastest, mm';
COMMENT ON COLUMN surface_spline.weights IS 'weight of each pole in the same order; null where not rational';

CREATE TABLE surface_swept (
    surface_id BIGINT PRIMARY KEY,
    basis_arc_id BIGINT,
    basis_surface_id BIGINT,
    axis_x DOUBLE PRECISION,
    axis_y DOUBLE PRECISION,
    axis_z DOUBLE PRECISION,
    distance DOUBLE PRECISION,
    CHECK ((basis_arc_id IS NULL) <> (basis_surface_id IS NULL))
);
COMMENT ON TABLE surface_swept IS 'What surfaces of kind extrusion, revolution and offset are made from.';
COMMENT ON COLUMN surface_swept.surface_id IS 'the surface';
COMMENT ON COLUMN surface_swept.basis_arc_id IS 'the curve that is extruded or revolved';
COMMENT ON COLUMN surface_swept.basis_surface_id IS 'the surface that is offset';
COMMENT ON COLUMN surface_swept.axis_x IS 'x of the direction of extrusion or axis of revolution, unit';
COMMENT ON COLUMN surface_swept.axis_y IS 'y of the direction of extrusion or axis of revolution, unit';
COMMENT ON COLUMN surface_swept.axis_z IS 'z of the direction of extrusion or axis of revolution, unit';
COMMENT ON COLUMN surface_swept.distance IS 'offset along the basis surface''s normal dS/du x dS/dv, mm';

CREATE TABLE loop (
    surface_id BIGINT NOT NULL,
    loop_no INTEGER NOT NULL,
    outer_loop BOOLEAN NOT NULL,
    PRIMARY KEY (surface_id, loop_no)
);
COMMENT ON TABLE loop IS 'The closed loops of coedges that bound a surface''s domain.';
COMMENT ON COLUMN loop.surface_id IS 'the surface';
COMMENT ON COLUMN loop.loop_no IS 'ordinal of the loop; the outer ones come first';
COMMENT ON COLUMN loop.outer_loop IS 'whether the loop is the outer boundary; several where loops go around a periodic surface';

CREATE TABLE coedge (
    surface_id BIGINT NOT NULL,
    loop_no INTEGER NOT NULL,
    coedge_no INTEGER NOT NULL,
    arc_id BIGINT NOT NULL,
    reversed BOOLEAN NOT NULL,
    tolerance DOUBLE PRECISION,
    PRIMARY KEY (surface_id, loop_no, coedge_no),
    CHECK (tolerance > 0)
);
COMMENT ON TABLE coedge IS 'The use of an arc by a loop; material lies to its left seen from outside.';
COMMENT ON COLUMN coedge.surface_id IS 'the surface';
COMMENT ON COLUMN coedge.loop_no IS 'the loop';
COMMENT ON COLUMN coedge.coedge_no IS 'ordinal along the loop';
COMMENT ON COLUMN coedge.arc_id IS 'the arc';
COMMENT ON COLUMN coedge.reversed IS 'whether the loop runs against the arc''s parameter';
COMMENT ON COLUMN coedge.tolerance IS 'how far the arc may lie off the surface and end off the start of the next, mm: 0.01, or what the CAD kernel states for the edge up to 0.1 mm or 1e-4 of the shape; where loading found more (load_finding) or fitted a mesh, what it measured; null where it could not';

CREATE TABLE pcurve (
    surface_id BIGINT NOT NULL,
    loop_no INTEGER NOT NULL,
    coedge_no INTEGER NOT NULL,
    kind TEXT NOT NULL,
    origin_u DOUBLE PRECISION,
    origin_v DOUBLE PRECISION,
    axis_u DOUBLE PRECISION,
    axis_v DOUBLE PRECISION,
    direct BOOLEAN NOT NULL,
    radius DOUBLE PRECISION,
    radius2 DOUBLE PRECISION,
    t0 DOUBLE PRECISION NOT NULL,
    t1 DOUBLE PRECISION NOT NULL,
    degree INTEGER,
    periodic BOOLEAN,
    knots DOUBLE PRECISION[],
    multiplicities INTEGER[],
    poles DOUBLE PRECISION[],
    weights DOUBLE PRECISION[],
    PRIMARY KEY (surface_id, loop_no, coedge_no),
    CHECK (kind IN ('line', 'circle', 'ellipse', 'parabola', 'hyperbola', 'spline'))
);
COMMENT ON TABLE pcurve IS 'The curve of a coedge in the surface''s (u, v) domain, over the arc''s interval, where the source has it.';
COMMENT ON COLUMN pcurve.surface_id IS 'the surface';
COMMENT ON COLUMN pcurve.loop_no IS 'the loop';
COMMENT ON COLUMN pcurve.coedge_no IS 'the coedge';
COMMENT ON COLUMN pcurve.kind IS 'line: (u, v) = O + t X; circle, ellipse: O + R cos t X + r sin t Y; parabola, hyperbola as arcs; spline';
COMMENT ON COLUMN pcurve.origin_u IS 'u of O';
COMMENT ON COLUMN pcurve.origin_v IS 'v of O';
COMMENT ON COLUMN pcurve.axis_u IS 'u of the unit vector X';
COMMENT ON COLUMN pcurve.axis_v IS 'v of the unit vector X';
COMMENT ON COLUMN pcurve.direct IS 'whether Y is X turned by +90 degrees, else its negative';
COMMENT ON COLUMN pcurve.radius IS 'R';
COMMENT ON COLUMN pcurve.radius2 IS 'r';
COMMENT ON COLUMN pcurve.t0 IS 'start of the interval';
COMMENT ON COLUMN pcurve.t1 IS 'end of the interval';
COMMENT ON COLUMN pcurve.degree IS 'degree of a spline';
COMMENT ON COLUMN pcurve.periodic IS 'whether a spline is periodic';
COMMENT ON COLUMN pcurve.knots IS 'distinct knots of a spline';
COMMENT ON COLUMN pcurve.multiplicities IS 'multiplicity of each knot';
COMMENT ON COLUMN pcurve.poles IS 'poles of a spline, u v after each other';
COMMENT ON COLUMN pcurve.weights IS 'weight of each pole; null where not rational';

INSERT INTO sds_relation (relation, level, standing) VALUES
    ('arc', 'surface', 'primary'),
    ('arc_spline', 'surface', 'primary'),
    ('arc_offset', 'surface', 'primary'),
    ('surface', 'surface', 'primary'),
    ('surface_spline', 'surface', 'primary'),
    ('surface_swept', 'surface', 'primary'),
    ('loop', 'surface', 'primary'),
    ('coedge', 'surface', 'primary'),
    ('pcurve', 'surface', 'primary');

INSERT INTO sds_reference (relation, reference_no, column_names, parent, parent_columns) VALUES
    ('arc_spline', 0, ARRAY['arc_id'], 'arc', ARRAY['id']),
    ('arc_offset', 0, ARRAY['arc_id'], 'arc', ARRAY['id']),
    ('arc_offset', 1, ARRAY['basis_arc_id'], 'arc', ARRAY['id']),
    ('surface_spline', 0, ARRAY['surface_id'], 'surface', ARRAY['id']),
    ('surface_swept', 0, ARRAY['surface_id'], 'surface', ARRAY['id']),
    ('surface_swept', 1, ARRAY['basis_arc_id'], 'arc', ARRAY['id']),
    ('surface_swept', 2, ARRAY['basis_surface_id'], 'surface', ARRAY['id']),
    ('loop', 0, ARRAY['surface_id'], 'surface', ARRAY['id']),
    ('coedge', 0, ARRAY['arc_id'], 'arc', ARRAY['id']),
    ('coedge', 1, ARRAY['surface_id', 'loop_no'], 'loop', ARRAY['surface_id', 'loop_no']),
    ('pcurve', 0, ARRAY['surface_id', 'loop_no', 'coedge_no'], 'coedge', ARRAY['surface_id', 'loop_no', 'coedge_no']);
