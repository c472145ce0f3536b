"""Charts of other programs (GeoTIFF, NetCDF, ASCII grids), read off line and block by block; needs the extra ``charts``."""
