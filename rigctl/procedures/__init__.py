"""What a laboratory does before a test: tare, mounting and removal, warm-up, crawl, weighing."""
