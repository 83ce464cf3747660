"""Decoders of meshopt's compressed streams, by the specification of KHR_meshopt_compression (appendix A and B)."""
