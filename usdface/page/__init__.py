"""Pages: a shot, or any face with blend shapes, as one HTML file that needs no network."""
