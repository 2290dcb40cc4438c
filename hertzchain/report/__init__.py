"""Reports for people and programs: console, plots, pages, tables, JUnit, trajectories."""
