/**
 * @file packet_table.h
 * The packets of host/docs/link.md, written down a second time: what the parser must accept, and nothing else.
 */
#pragma once

#include "edge_link.h"
#include "fuzz.h"

/** CRC-16/CCITT-FALSE: the remainders of the 256 bytes, found bit by bit as the standard says it. */
static inline uint16_t standardCrc(const uint8_t *bytes, size_t length) {
  static uint16_t remainder[256];
  for (int byte = 1; byte < 256 && remainder[255] == 0; byte++) {
    uint32_t crc = (uint32_t)byte << 8;
    for (int bit = 0; bit < 8; bit++) {
      crc = crc << 1 ^ (crc & 0x8000 ? 0x1021 : 0);
    }
    remainder[byte] = (uint16_t)crc;
  }
  uint16_t crc = 0xffff;
  for (size_t i = 0; i < length; i++) {
    crc = (uint16_t)(crc << 8 ^ remainder[crc >> 8 ^ bytes[i]]);
  }
  return crc;
}

/** Bytes of the body of a packet, from the table of the types; -1 where there is no such body. */
static inline int tableBody(uint8_t type, const uint8_t *body, int room) {
  switch (type) {
    case 1:  // nonce, detector, digest
      return 4 + 1 + 8;
    case 2:  // back, count, samples
      return room >= 3 && body[2] >= 1 && body[2] <= 7 ? 2 + 1 + 12 * body[2] : -1;
    case 3:  // expected, flags, count, answers
      return room >= 6 && body[5] <= 7 ? 4 + 1 + 1 + 4 * body[5] : -1;
    case 4:  // uptime, expected, used, lost, refused, detector, flags, digest
      return 4 + 4 + 4 + 4 + 4 + 1 + 1 + 8;
    default: return -1;
  }
}

/** Whether the bytes are a packet. */
static inline bool inTable(const uint8_t *bytes, int length) {
  if (length < 10 || length > 98 || bytes[0] != 0xA1 || bytes[2] != length) {
    return false;
  }
  const uint16_t crc = (uint16_t)(bytes[length - 2] | bytes[length - 1] << 8);
  return tableBody(bytes[1], bytes + 8, length - 10) == length - 10 && crc == standardCrc(bytes, (size_t)length - 2);
}

/** Writes the CRC that makes @p length bytes right. */
static inline void mendCrc(uint8_t *bytes, int length) {
  if (length >= 2) {
    const uint16_t crc = standardCrc(bytes, (size_t)length - 2);
    bytes[length - 2] = (uint8_t)crc;
    bytes[length - 1] = (uint8_t)(crc >> 8);
  }
}
