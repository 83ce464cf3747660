"""Identify the hardware behind a device: its UUID and PCI address, if the driver reports them.

By the extensions cl_khr_device_uuid, cl_khr_pci_bus_info, cl_nv_device_attribute_query and
cl_amd_device_attribute_query. pyopencl supports only some of them, so clGetDeviceInfo is called directly.
"""

from __future__ import annotations

import ctypes
import struct

import pyopencl as cl

from .loader import library

UUID_KHR, PCI_BUS_INFO_KHR = 0x106A, 0x410F
PCI_BUS_ID_NV, PCI_SLOT_ID_NV, PCI_DOMAIN_ID_NV = 0x4008, 0x4009, 0x400A
TOPOLOGY_AMD, TOPOLOGY_PCIE = 0x4037, 1


def hardware(device: cl.Device) -> tuple[str, ...]:
    """Return "UUID …" and "PCI domain:bus:device.function", as far as the driver reports them."""
    extensions = device.extensions.split()
    found = []
    if "cl_khr_device_uuid" in extensions and (uuid := _told(device, UUID_KHR, 16)):
        found.append(f"UUID {uuid.hex()}")
    if place := _pci(device, extensions):
        found.append("PCI {:04x}:{:02x}:{:02x}.{:x}".format(*place))
    return tuple(found)


def _pci(device: cl.Device, extensions: list[str]) -> tuple[int, ...]:
    """Return domain, bus, device and function, or an empty tuple."""
    if "cl_khr_pci_bus_info" in extensions and (told := _told(device, PCI_BUS_INFO_KHR, 16)):
        return struct.unpack("=4I", told)
    if "cl_nv_device_attribute_query" in extensions:
        domain, bus, slot = (_told(device, query, 4) for query in (PCI_DOMAIN_ID_NV, PCI_BUS_ID_NV, PCI_SLOT_ID_NV))
        if bus and slot:
            number = struct.unpack("=I", slot)[0]
            return (*struct.unpack("=2I", (domain or bytes(4)) + bus), number >> 3, number & 7)
    if "cl_amd_device_attribute_query" in extensions and (told := _told(device, TOPOLOGY_AMD, 24)):
        kind, *place = struct.unpack("=I17x3B", told)
        return (0, *place) if kind == TOPOLOGY_PCIE else ()
    return ()


def _told(device: cl.Device, query: int, size: int) -> bytes:
    """Return the driver's answer to a query; empty if it fails or has another size."""
    answer, length = ctypes.create_string_buffer(size), ctypes.c_size_t()
    error = library().clGetDeviceInfo(
        ctypes.c_void_p(device.int_ptr), ctypes.c_uint(query), ctypes.c_size_t(size), answer, ctypes.byref(length)
    )
    return answer.raw if not error and length.value == size else b""
