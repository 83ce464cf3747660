"""The estimated error of a picture, its history, and adaptive sampling."""
