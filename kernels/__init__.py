"""The OpenCL C sources of clrt, importable as package data under the name `clrt.kernels`."""
