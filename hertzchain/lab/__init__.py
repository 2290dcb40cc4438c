"""What a laboratory uses: fits to measured forces, and effects of uncertain values."""
