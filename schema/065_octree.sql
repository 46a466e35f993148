-- Level object: an oct-tree of the parts of an expanded object, where one was asked for, as tables that a query walks.

CREATE TABLE octree_cell (
    object_id BIGINT NOT NULL,
    cell INTEGER NOT NULL,
    body_no INTEGER NOT NULL,
    parent INTEGER,
    x0 DOUBLE PRECISION NOT NULL,
    y0 DOUBLE PRECISION NOT NULL,
    z0 DOUBLE PRECISION NOT NULL,
    x1 DOUBLE PRECISION NOT NULL,
    y1 DOUBLE PRECISION NOT NULL,
    z1 DOUBLE PRECISION NOT NULL,
    CHECK (x0 <= x1 AND y0 <= y1 AND z0 <= z1),
    PRIMARY KEY (object_id, cell)
);
COMMENT ON TABLE octree_cell IS 'Cells of oct-trees over the boxes of object_node, one tree a body; cells that are empty are not kept.';
COMMENT ON COLUMN octree_cell.object_id IS 'the object that is expanded';
COMMENT ON COLUMN octree_cell.cell IS 'ordinal of the cell';
COMMENT ON COLUMN octree_cell.body_no IS 'the body whose parts it holds';
COMMENT ON COLUMN octree_cell.parent IS 'the cell that was halved along each axis; null for the root';
COMMENT ON COLUMN octree_cell.x0 IS 'least x of the cell in the body''s frame, mm';
COMMENT ON COLUMN octree_cell.y0 IS 'least y of the cell in the body''s frame, mm';
COMMENT ON COLUMN octree_cell.z0 IS 'least z of the cell in the body''s frame, mm';
COMMENT ON COLUMN octree_cell.x1 IS 'greatest x of the cell in the body''s frame, mm';
COMMENT ON COLUMN octree_cell.y1 IS 'greatest y of the cell in the body''s frame, mm';
COMMENT ON COLUMN octree_cell.z1 IS 'greatest z of the cell in the body''s frame, mm';

CREATE TABLE octree_entry (
    object_id BIGINT NOT NULL,
    cell INTEGER NOT NULL,
    node_no INTEGER NOT NULL,
    PRIMARY KEY (object_id, cell, node_no)
);
COMMENT ON TABLE octree_entry IS 'The parts of an expanded object in the leaves of its oct-tree: those that the cube about the part touches which holds its world box however the object is turned.';
COMMENT ON COLUMN octree_entry.object_id IS 'the object that is expanded';
COMMENT ON COLUMN octree_entry.cell IS 'a leaf of octree_cell';
COMMENT ON COLUMN octree_entry.node_no IS 'the part, a node of object_node';

INSERT INTO sds_relation (relation, level, standing) VALUES
    ('octree_cell', 'object', 'redundant'),
    ('octree_entry', 'object', 'redundant');

INSERT INTO sds_reference (relation, reference_no, column_names, parent, parent_columns) VALUES
    ('octree_cell', 0, ARRAY['object_id'], 'object', ARRAY['id']),
    ('octree_entry', 0, ARRAY['object_id', 'cell'], 'octree_cell', ARRAY['object_id', 'cell']);
