/* CRC-32C (Castagnoli, reflected polynomial 0x82F63B78) with constant tables of four bits. */
#include "bits/platform.h"

/* Makes the row of all 16 values from those of the single bits. */
#define CRC_ROW(a, b, c, d)                                                                                            \
    {0,   (a),       (b),       (a) ^ (b),       (c),       (a) ^ (c),       (b) ^ (c),       (a) ^ (b) ^ (c),         \
     (d), (a) ^ (d), (b) ^ (d), (a) ^ (b) ^ (d), (c) ^ (d), (a) ^ (c) ^ (d), (b) ^ (c) ^ (d), (a) ^ (b) ^ (c) ^ (d)}

/* Row k belongs to bits 4 k to 4 k + 3 of a word. WebAssembly, which travels with its page, has only the last row. */
#if defined(__wasm__)
enum { CRC_ROWS = 1 };
#define CRC_ROWS_BEFORE
#else
enum { CRC_ROWS = 8 };
#define CRC_ROWS_BEFORE                                                                                                \
    CRC_ROW(0xdd45aab8u, 0xbf672381u, 0x7b2231f3u, 0xf64463e6u),                                                       \
        CRC_ROW(0xe964b13du, 0xd725148bu, 0xaba65fe7u, 0x52a0c93fu),                                                   \
        CRC_ROW(0xa541927eu, 0x4f6f520du, 0x9edea41au, 0x38513ec5u),                                                   \
        CRC_ROW(0x70a27d8au, 0xe144fb14u, 0xc76580d9u, 0x8b277743u),                                                   \
        CRC_ROW(0x13a29877u, 0x274530eeu, 0x4e8a61dcu, 0x9d14c3b8u),                                                   \
        CRC_ROW(0x3fc5f181u, 0x7f8be302u, 0xff17c604u, 0xfbc3faf9u),                                                   \
        CRC_ROW(0xf26b8303u, 0xe13b70f7u, 0xc79a971fu, 0x8ad958cfu),
#endif

static const uint32_t quarter_byte[CRC_ROWS][16] = {
    CRC_ROWS_BEFORE CRC_ROW(0x105ec76fu, 0x20bd8edeu, 0x417b1dbcu, 0x82f63b78u)};

ATH_INLINE uint32_t crc_word(const uint8_t *bytes)
{
    return (uint32_t)bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 | (uint32_t)bytes[3] << 24;
}

uint32_t ath_crc32c(uint32_t crc, const uint8_t *bytes, size_t size)
{
    size_t i = 0;
    crc = ~crc;
    for (; CRC_ROWS == 8 && i + 4 <= size; i += 4) {
        uint32_t word = crc ^ crc_word(bytes + i);
        crc = 0;
        for (int32_t k = 0; k < CRC_ROWS; k++) crc ^= quarter_byte[k][word >> 4 * k & 15];
    }
    for (; i < size; i++) {
        crc ^= bytes[i];
        for (int32_t k = 0; k < 2; k++) crc = crc >> 4 ^ quarter_byte[CRC_ROWS - 1][crc & 15];
    }
    return ~crc;
}
