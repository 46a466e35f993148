"""What matchers see of a picture or of a predicted view: units, the relations among them, and how well these repeat."""
