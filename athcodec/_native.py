"""The C core as Python sees it: record layouts, signatures, and one checked wrapper per function.

Mirrors core/include/ath.h, which players use (core_file.py), and core/model/*.h and core/encode/encode.h, which only
encoding uses (athcodec.encoding). Wrappers check dtypes, shapes and contiguity, so that no call can write outside an
array; they release the GIL, and hold no state.
"""

from __future__ import annotations

import ctypes
from ctypes import (
    POINTER,
    byref,
    c_char_p,
    c_double,
    c_int,
    c_int32,
    c_int64,
    c_size_t,
    c_uint8,
    c_uint32,
    c_uint64,
    c_void_p,
)
from typing import Any, TypeAlias

import numpy as np
from numpy import typing as npt

from athcodec._library import load_library, misfit
from athcodec.errors import BoundError
from athcodec.options import MAX_SEGMENT

BytesLike: TypeAlias = bytes | bytearray | memoryview | np.ndarray

PIECE_VERTICES = 64
SEGMENT_FRAMES = MAX_SEGMENT
SHAPE_MODES = 16
SHEET, LOOSE, WHOLE, STILL = 1, 2, 4, 8
RIGID = 16
"""Of a piece in a layer."""
SHORT_SHIFT, SHORT_FLOATS = 18, 255 << 5
"""Of the error table: floats without sign, of which the top bits of binary32 are stored."""
MEASURES = "max", "p99", "rms"
"""ath_measure, in its order."""


def fields(*types_and_names: Any) -> list[tuple[str, Any]]:
    """Return (name, type) of each field of a record, from types that are each followed by their fields' names."""
    pairs = zip(types_and_names[::2], types_and_names[1::2])
    return [(name, kind) for kind, names in pairs for name in names.split()]


# Records that the core repeats, in arrays (dtypes) or on their own (structs). `check_layouts` compares them.
BRANCH = np.dtype(fields("<i4", "parent count attach flags lag first subtree depth rigid detail ring"))
PIECE = np.dtype(
    fields(
        *("<i8", "modes basis attach_cache", "<u8", "attached"),
        *("<i4", "first count parent attach branch flags rank stage low_stage low_modes last_attached ring"),
        *("<i4", "modes_stage tip_weight"),
    )
)
NODE = np.dtype(fields("9<f8", "whitening", "<i4", "branch piece first count stage last_stage coded rank"))
CHUNK = np.dtype(fields("<u8", "bytes offset", "<u4", "length checksum segment", "<u2", "kind", "u1", "level stage"))


class CorePlan(ctypes.Structure):
    """ath_plan."""

    _fields_ = fields(
        *(c_int32, "vertex_count branch_count piece_count node_count", c_int64, "attach_cache_rows"),
        *(c_int32, "height longest", c_void_p, "branches pieces nodes rest bases"),
    )


class Stream(ctypes.Structure):
    """ath_stream."""

    _fields_ = fields(
        *(c_double, "step rotation_step_factor", c_void_p, "temporal"),
        *(c_int32, "temporal_rank root", c_double, "turn_step"),
    )


class Motion(ctypes.Structure):
    """ath_motion."""

    _fields_ = fields(c_void_p, "streams waves attach_caches work before known", c_int32, "frames ratio")


class Coarse(ctypes.Structure):
    """ath_coarse."""

    _fields_ = fields(c_void_p, "plan motion integers turn_steps nothing")


class Integers(ctypes.Structure):
    """ath_integers."""

    _fields_ = fields(
        *(c_void_p, "coefficients tracks node_tracks node_steps predicted predicted_tracks"),
        *(c_void_p, "first_rows shape_counts shape_first shapes duals"),
    )


class Rounding(ctypes.Structure):
    """ath_rounding."""

    _fields_ = fields(c_double, "dead_zone", c_double * 3, "ends", c_int32, "roots_turn reserved")


class CoreMetEnds(ctypes.Structure):
    """ath_met_ends."""

    _fields_ = fields(c_void_p, "decided", c_int64, "count", c_int32, "closed reserved")


class Header(ctypes.Structure):
    """ath_header."""

    _fields_ = fields(
        *(c_uint64, "file_length front_length", c_double, "max_error"),
        *(c_uint32, "chunk_count vertex_count place_count branch_count frame_count segment_count"),
        *(c_int32, "level_count full_level_count clip_count layer_count is_float64 is_predicted has_faces stage_count"),
        *(c_uint8 * 32, "stages"),
    )


class CorePolygons(ctypes.Structure):
    """ath_polygons."""

    _fields_ = fields(c_uint32, "face_count corner_count columns", c_uint8, "is_mixed is_derived index_type count_type")


_WRITER = [c_void_p, c_void_p, c_size_t]  # Scratch memory, and the buffer with its size.
_SEGMENT = [POINTER(CorePlan), POINTER(Motion), POINTER(Integers)]
_PLAYING = {  # Functions of core/include/ath.h.
    "ath_result_name": (c_char_p, [c_int]),
    "ath_kind_name": (c_char_p, [c_int]),
    "ath_fault_text": (c_size_t, [c_void_p, c_char_p, c_size_t]),
    "ath_level_name": (c_size_t, [c_void_p, c_int32, c_char_p, c_size_t]),
    "ath_default_limits": (None, [c_void_p]),
    "ath_small_limits": (None, [c_void_p]),
    "ath_front": (c_int, [c_void_p, c_size_t, c_void_p, c_void_p, c_void_p, c_void_p]),
    "ath_open": (c_int, [c_void_p, c_size_t, c_void_p, c_size_t, c_void_p, c_void_p]),
    "ath_set_host_mesh": (c_int, [c_void_p, c_void_p, c_size_t, c_int32, c_void_p]),
    "ath_build_size": (c_size_t, [c_void_p]),
    "ath_build": (c_int, [c_void_p, c_void_p, c_size_t]),
    "ath_refine_size": (c_int, [c_void_p, c_int32, c_void_p, c_void_p]),
    "ath_refine": (c_int, [c_void_p, c_int32, c_void_p, c_size_t]),
    "ath_read_rest": (c_int, [c_void_p, c_void_p]),
    "ath_level_rest": (c_int, [c_void_p, c_int32, c_int, c_void_p, c_size_t]),
    "ath_get_info": (None, [c_void_p, c_void_p]),
    "ath_branches": (c_void_p, [c_void_p]),
    "ath_vertex_source": (c_void_p, [c_void_p]),
    "ath_vertex_places": (c_void_p, [c_void_p]),
    "ath_branch_source": (c_void_p, [c_void_p]),
    "ath_times": (c_void_p, [c_void_p]),
    "ath_clips": (c_void_p, [c_void_p]),
    "ath_seam_error": (c_double, [c_void_p, c_int32, c_int32]),
    "ath_rest_float64": (c_int, [c_void_p, c_int, c_void_p, c_size_t]),
    "ath_chunks": (c_void_p, [c_void_p]),
    "ath_check_chunk": (c_int, [c_void_p, c_int32, c_void_p]),
    "ath_errors": (c_void_p, [c_void_p]),
    "ath_level_error": (c_double, [c_void_p, c_int32, c_int32, c_int32, c_int]),
    "ath_segment_start": (c_int32, [c_void_p, c_int32]),
    "ath_work_fault": (None, [c_void_p, c_void_p]),
    "ath_polygons_of": (c_int, [c_void_p, c_int, POINTER(CorePolygons), c_void_p]),
    "ath_polygons_size": (c_size_t, [c_void_p]),
    "ath_read_polygons": (c_int, [c_void_p, c_int, c_void_p, c_size_t, *[c_void_p] * 3]),
    "ath_feed": (None, [c_void_p, c_void_p, c_uint64, c_size_t]),
    "ath_drop": (None, [c_void_p, c_uint64, c_uint64]),
    "ath_onward_ranges": (c_int32, [c_void_p, *[c_int32] * 4, c_int, c_void_p, c_int32]),
    "ath_cut_size": (None, [c_void_p, c_int32, c_void_p, c_void_p, c_void_p]),
    "ath_cut": (None, [c_void_p, c_int32, c_void_p]),
    "ath_ranges": (c_int32, [c_void_p, *[c_int32] * 3, c_int, c_void_p, c_int32]),
    "ath_follow": (c_int, [c_void_p, c_void_p]),
    "ath_prepare_to": (c_int, [c_void_p, c_void_p]),
    "ath_joined_to": (c_int32, [c_void_p, c_int32, c_int32]),
    "ath_joins": (c_void_p, [c_void_p]),
    "ath_stages": (c_void_p, [c_void_p]),
    "ath_repeats": (c_void_p, [c_void_p]),
    "ath_work_size": (c_size_t, [c_void_p]),
    "ath_segment_size": (c_size_t, [c_void_p, c_int32]),
    "ath_segment_size_to": (c_size_t, [c_void_p, c_int32, c_int32]),
    "ath_prepare_start": (c_int, [c_void_p, c_size_t, c_void_p, c_int32, c_int32, c_void_p, c_size_t]),
    "ath_prepare_step": (c_int, [c_void_p, c_int32]),
    "ath_prepare_onward": (c_int, [c_void_p, c_size_t, *[c_void_p] * 3, c_int32, c_void_p, c_size_t]),
    "ath_keep_size": (c_size_t, [c_void_p, c_int32]),
    "ath_keep": (c_int, [c_void_p, c_void_p, c_size_t]),
    "ath_kept_size": (c_size_t, [c_void_p]),
    "ath_goes_on": (c_int, [*[c_void_p] * 3, c_int32]),
    "ath_segment_index": (c_int32, [c_void_p]),
    "ath_segment_level": (c_int32, [c_void_p]),
    "ath_positions": (c_int, [c_void_p, c_void_p, c_int32, c_double, c_int, c_void_p, c_size_t]),
    "ath_positions_float64": (c_int, [c_void_p, c_void_p, c_int32, c_double, c_int, c_void_p, c_size_t]),
    "ath_frame_at": (c_double, [c_void_p, c_int32, c_double, c_int]),
    "ath_blend_size": (c_size_t, [c_void_p]),
    "ath_blended_positions": (c_int, [c_void_p, c_void_p, c_int32, c_int, c_void_p, c_size_t, c_void_p, c_size_t]),
    "ath_wind_weights": (None, [c_void_p, c_int32, c_double, c_double, c_void_p]),
    "ath_matrices_float64": (c_int, [c_void_p, c_void_p, c_int32, c_double, c_void_p, c_size_t]),
    "ath_level_for": (c_int32, [c_void_p, c_int32, c_int32, c_int, c_double, c_double, c_double, c_double]),
    "ath_crc32c": (c_uint32, [c_uint32, c_void_p, c_size_t]),
}
_ENCODING = {  # Functions of core/model/*.h and core/encode/encode.h.
    "ath_count_pieces": (c_int32, [c_void_p, c_int32, c_int32]),
    "ath_count_nodes": (c_int32, [c_void_p, c_int32]),
    "ath_build_plan": (None, [POINTER(CorePlan), *[c_void_p] * 3, c_int]),
    "ath_basis_table_size": (c_size_t, [c_int32]),
    "ath_basis_layout": (c_int64, [c_void_p, c_int32, *[c_void_p] * 3]),
    "ath_basis_modes": (None, [c_void_p, c_int32, c_int32, *[c_void_p] * 3]),
    "ath_basis_sheets": (None, [c_void_p, c_int32, c_int32, c_void_p, c_void_p]),
    "ath_principal": (None, [c_int32, c_int32, *[c_void_p] * 4]),
    "ath_plan_nodes": (None, [POINTER(CorePlan), c_void_p, c_int32, c_int32]),
    "ath_waves": (None, [c_int32, c_int32, c_void_p]),
    "ath_motion_work": (c_size_t, [c_int32, c_int32]),
    "ath_attach_cache_size": (c_size_t, [c_int64, c_int32]),
    "ath_layout": (c_char_p, [c_int32, c_void_p, c_void_p]),
    "ath_model_size": (c_size_t, []),
    "ath_fit": (None, [*[c_int32] * 3, c_void_p, c_int32, *[c_void_p] * 5, c_double, *[c_void_p] * 7]),
    "ath_gather": (None, [c_int32, c_int32, c_void_p, c_int32, c_int, *[c_void_p] * 3]),
    "ath_analyse": (None, [*_SEGMENT, c_int32, c_int32, c_void_p, POINTER(Rounding), c_int, c_void_p, c_int, c_void_p]),
    "ath_analyse_nodes": (None, [*_SEGMENT, c_int32, c_int32, c_void_p, c_void_p, POINTER(Rounding)]),
    "ath_pose": (None, [*_SEGMENT, *[c_int32] * 3, c_void_p, c_int, c_void_p]),
    "ath_pose_nodes": (None, [*_SEGMENT, *[c_int32] * 3, c_void_p, c_int, c_void_p]),
    "ath_add_bends": (None, [c_int64, c_int32, c_int, c_void_p, c_void_p]),
    "ath_add_moments": (c_int64, [c_int64, c_int32, c_void_p, c_double, c_void_p]),
    "ath_row_products": (None, [c_int64, c_void_p, c_int32, c_int32, c_void_p, c_void_p]),
    "ath_multiply": (None, [*[c_int64] * 4, c_void_p, c_int64, c_void_p, c_int64, c_void_p]),
    "ath_decompose": (None, [c_int64, *[c_void_p] * 4]),
    "ath_solve": (None, [c_int64, c_int32, c_int32, c_void_p, c_void_p]),
    "ath_error": (None, [c_int32, c_int32, c_void_p, c_void_p, c_int, *[c_void_p] * 3, c_double, *[c_void_p] * 3]),
    "ath_find_corrections": (
        c_int64,
        [c_int32, c_int32, c_int, *[c_void_p] * 5, c_double, POINTER(CoreMetEnds), c_void_p, c_int64],
    ),
    "ath_find_rigid_corrections": (
        c_int64,
        [c_int32, c_void_p, c_void_p, c_int32, c_int, *[c_void_p] * 4, c_int, c_double, c_int32, c_void_p, c_int64],
    ),
    "ath_apply_corrections": (None, [c_int32, c_int, c_void_p, c_double, c_void_p, c_int64]),
    "ath_encode_front": (c_int64, [c_void_p, c_size_t, POINTER(Header), *[c_void_p] * 4]),
    "ath_encode_hierarchy": (c_int64, [*_WRITER, c_void_p, c_int32, c_int32, c_void_p, c_void_p]),
    "ath_mesh_size": (c_size_t, [c_int32, c_int32]),
    "ath_place_mesh": (None, [c_void_p, c_int32, c_int32]),
    "ath_build_mesh": (None, [c_void_p, c_int32, POINTER(CorePolygons), *[c_void_p] * 3]),
    "ath_faces_memory": (c_uint64, [c_int32, c_int32]),
    "ath_encode_faces": (
        c_int64,
        [*_WRITER, POINTER(CorePolygons), c_int32, c_void_p, c_int32, c_void_p, c_void_p, c_int32],
    ),
    "ath_encode_places": (c_int64, [*_WRITER, c_uint32, c_int32, c_int32, c_void_p]),
    "ath_hash_positions": (None, [c_int64, c_void_p, *[c_int32] * 2, *[c_int] * 2, c_void_p, c_void_p]),
    "ath_find_near": (None, [*[c_int32] * 3, c_void_p, c_void_p, c_double, c_void_p, c_uint32, c_void_p]),
    "ath_find_far": (None, [c_int64, *[c_void_p] * 2, *[c_int32] * 2, c_int, c_void_p, c_void_p]),
    "ath_find_apart": (None, [c_int64, *[c_void_p] * 2, *[c_int32] * 2, *[c_int] * 2, c_void_p, c_void_p]),
    "ath_encode_rest": (c_int64, [*_WRITER, c_void_p, c_int32, c_double, c_double, *[c_void_p] * 8]),
    "ath_find_copies": (c_int32, [c_void_p, c_int32, c_void_p, c_double, c_double, c_void_p, c_void_p]),
    "ath_encode_refined_shapes": (c_int64, [*_WRITER, POINTER(CorePlan), *[c_void_p] * 6, c_int32]),
    "ath_encode_source_rest": (c_int64, [*_WRITER, c_void_p, c_int32, c_double, *[c_void_p] * 5]),
    "ath_encode_exact_rest": (c_int64, [*_WRITER, c_void_p, c_int32, c_void_p, c_int, c_void_p]),
    "ath_encode_times": (c_int64, [*_WRITER, c_int32, c_void_p]),
    "ath_add_basis_rows": (None, [c_void_p, *[c_int32] * 3, *[c_void_p] * 3]),
    "ath_encode_basis": (c_int64, [*_WRITER, c_int32, c_int32, c_void_p, c_void_p]),
    "ath_encode_temporal": (c_int64, [*_WRITER, c_int32, c_int32, c_void_p]),
    "ath_mode_weights": (None, [c_void_p, c_void_p]),
    "ath_unit_shapes": (c_int, [c_int32, c_void_p, c_void_p]),
    "ath_encode_shapes": (c_int64, [*_WRITER, POINTER(CorePlan), *[c_void_p] * 3, c_int32]),
    "ath_encode_exact": (c_int64, [*_WRITER, c_int32, c_int32, c_int, c_void_p, c_void_p]),
    "ath_encode_stems": (c_int64, [*_WRITER, *_SEGMENT, c_int32]),
    "ath_encode_refinement": (c_int64, [*_WRITER, *_SEGMENT, c_int32]),
    "ath_encode_affines": (c_int64, [*_WRITER, *_SEGMENT, c_int32]),
    "ath_plan_rigid": (None, [POINTER(CorePlan), c_void_p, c_int32]),
    "ath_without_stems": (None, [POINTER(CorePlan), c_void_p, c_void_p]),
    "ath_predicted_memory": (c_size_t, [c_int32]),
    "ath_encode_predicted": (
        c_int64,
        [
            *(*_WRITER, POINTER(CorePlan), c_void_p, c_int32, c_int, c_double, c_void_p, c_int64, c_void_p, c_int32),
            *(c_void_p, c_void_p),
        ],
    ),
    "ath_encode_corrections": (c_int64, [*_WRITER, c_int32, c_int32, c_void_p, c_int64]),
}


def _bind() -> ctypes.CDLL:
    library = load_library()
    for name, (result, arguments) in (_PLAYING | _ENCODING).items():
        if (function := getattr(library, name, None)) is None:
            raise misfit(library._name, f"got a library without {name}()")
        function.restype, function.argtypes = result, arguments
    return library


lib = _bind()


def _core_layouts() -> dict[str, dict[str, tuple[int, int]]]:
    """Return the layouts of the C core's structs: by a struct's name and a field's name, the pair of offset and size in
    bytes. The field "" stands for the whole struct.
    """
    structs: dict[str, dict[str, tuple[int, int]]] = {}
    offset, size, index = c_size_t(), c_size_t(), 0
    while (entry := lib.ath_layout(index, byref(offset), byref(size))) is not None:
        struct, _, field = entry.decode().partition(".")
        structs.setdefault(struct, {})[field] = offset.value, size.value
        index += 1
    return structs


CORE_LAYOUTS = _core_layouts()


def check_layouts(mirrors: dict[str, type[ctypes.Structure] | np.dtype]) -> None:
    """Raise ImportError unless the given ctypes classes and NumPy dtypes have the same layouts as the C core's structs
    of the same names.
    """
    for struct, mirror in mirrors.items():
        if isinstance(mirror, np.dtype):
            layout = {"": (0, mirror.itemsize)}
            layout |= {name: (field[1], field[0].itemsize) for name, field in (mirror.fields or {}).items()}
        else:
            layout = {"": (0, ctypes.sizeof(mirror))}
            layout |= {name: (getattr(mirror, name).offset, getattr(mirror, name).size) for name, *_ in mirror._fields_}
        core = CORE_LAYOUTS.get(struct, {})
        differing = sorted({name for name, _ in layout.items() ^ core.items()})
        if differing:
            got, expected = ({name: side.get(name) for name in differing} for side in (core, layout))
            raise misfit(lib._name, f"struct {struct}: got (offset, size) {got}, expected {expected} as in Python")


MIRRORS: dict[str, type[ctypes.Structure] | np.dtype] = {
    "ath_branch": BRANCH,
    "ath_chunk": CHUNK,
    "ath_node": NODE,
    "ath_piece": PIECE,
    "ath_plan": CorePlan,
    "ath_coarse": Coarse,
    "ath_integers": Integers,
    "ath_motion": Motion,
    "ath_stream": Stream,
    "ath_header": Header,
    "ath_met_ends": CoreMetEnds,
    "ath_polygons": CorePolygons,
    "ath_rounding": Rounding,
}
check_layouts(MIRRORS)


def address(array: np.ndarray | None, dtype: npt.DTypeLike, size: int) -> int | None:
    """Return the address of the data of a contiguous array that has at least `size` items of `dtype`; None for None.

    Raise TypeError if the array is anything else, because the C core would corrupt memory.
    """
    if array is None:
        return None
    if array.dtype != np.dtype(dtype) or not array.flags.c_contiguous or array.size < size:
        raise TypeError(
            f"C core: got {array.dtype} {array.shape}, contiguous={array.flags.c_contiguous}; "
            f"expected at least {size} contiguous {np.dtype(dtype)}"
        )
    return array.ctypes.data


def new_model() -> np.ndarray:
    """Return scratch memory for one coding call at a time."""
    return np.empty(lib.ath_model_size() // 8 + 1, np.uint64)


def as_bytes(data: BytesLike) -> np.ndarray:
    """Return bytes-like data as an array that can be handed to the core."""
    return np.frombuffer(data, np.uint8) if len(data) else np.zeros(1, np.uint8)[:0]


def crc32c(data: BytesLike, crc: int = 0) -> int:
    """Return the CRC-32C of bytes-like data, continuing from `crc`."""
    array = as_bytes(data)
    return lib.ath_crc32c(crc, array.ctypes.data, array.size)


def encode_stream(function_name: str, capacity: int, *arguments: object, model: np.ndarray | None = None) -> bytes:
    """Run one of the C core's writers and return the stream that it writes. `capacity` is the size of the buffer in
    bytes, which grows until the stream fits, and `model` the writer's scratch memory, by default that of `new_model`.
    """
    model = new_model() if model is None else model
    while True:
        buffer = np.empty(capacity, np.uint8)
        size = getattr(lib, function_name)(model.ctypes.data, buffer.ctypes.data, capacity, *arguments)
        if size >= 0:
            return buffer[:size].tobytes()
        if size < -1:
            raise BoundError(
                f"{function_name}: got integers that the stream cannot hold; expected a larger error bound"
            )
        capacity *= 4
