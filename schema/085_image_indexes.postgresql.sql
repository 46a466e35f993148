-- What a picture gives stands in tables without keys (070_image.sql).  DuckDB finds an extraction's rows by the least and
-- greatest identity of each row group; PostgreSQL wants an index.
CREATE INDEX image_blob_image ON image_blob (image_id);
CREATE UNIQUE INDEX edge_element_key ON edge_element (extraction_id, edge_element_no);
CREATE UNIQUE INDEX image_arc_key ON image_arc (extraction_id, image_arc_no);
CREATE INDEX image_arc_point_extraction ON image_arc_point (extraction_id);
CREATE INDEX image_junction_extraction ON image_junction (extraction_id);
CREATE INDEX image_junction_arc_extraction ON image_junction_arc (extraction_id);
CREATE UNIQUE INDEX image_region_key ON image_region (extraction_id, region_no);
CREATE INDEX region_outline_extraction ON region_outline (extraction_id);
CREATE INDEX region_arc_extraction ON region_arc (extraction_id);
CREATE UNIQUE INDEX unit_key ON unit (unit_set_id, unit_no);
CREATE INDEX unit_relation_unit_set ON unit_relation (unit_set_id, unit_a, unit_b);
