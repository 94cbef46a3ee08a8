#include "edge_link.h"

#include <string.h>

#define HEADER_BYTES 8
#define CRC_BYTES 2

/** Where the next number is written or read. */
typedef struct {
  uint8_t *at;
} writer_t;

typedef struct {
  const uint8_t *at;
} reader_t;

uint16_t edgeLinkCrc(const uint8_t *bytes, uint16_t length) {
  // The remainders of the sixteen values of four bits.
  static const uint16_t remainder[16] = {0x0000, 0x1021, 0x2042, 0x3063, 0x4084, 0x50a5, 0x60c6, 0x70e7,
                                         0x8108, 0x9129, 0xa14a, 0xb16b, 0xc18c, 0xd1ad, 0xe1ce, 0xf1ef};
  uint32_t crc = 0xffff;
  for (uint16_t i = 0; i < length; i++) {
    crc = (crc << 4) ^ remainder[((crc >> 12) ^ (bytes[i] >> 4)) & 15u];
    crc = (crc << 4) ^ remainder[((crc >> 12) ^ bytes[i]) & 15u];
  }
  return (uint16_t)crc;
}

static void put(writer_t *to, uint32_t value, int bytes) {
  for (int i = 0; i < bytes; i++) {
    *to->at++ = (uint8_t)(value >> (8 * i));
  }
}

static void putBytes(writer_t *to, const void *from, uint16_t bytes) {
  memcpy(to->at, from, bytes);
  to->at += bytes;
}

static uint32_t get(reader_t *from, int bytes) {
  uint32_t value = 0;
  for (int i = 0; i < bytes; i++) {
    value |= (uint32_t)*from->at++ << (8 * i);
  }
  return value;
}

static void getBytes(reader_t *from, void *to, uint16_t bytes) {
  memcpy(to, from->at, bytes);
  from->at += bytes;
}

/** Bytes of a body whose count is known; 0 for what no body can be. */
static uint16_t bodyBytes(uint8_t type, uint8_t count) {
  switch (type) {
    case EDGE_LINK_RESET:
      return 4 + 1 + EDGE_LINK_DIGEST_BYTES;
    case EDGE_LINK_FEATURES:
      return count >= 1 && count <= EDGE_LINK_SAMPLES ? (uint16_t)(3 + count * EDGE_LINK_SAMPLE_BYTES) : 0;
    case EDGE_LINK_RESULT:
      return count <= EDGE_LINK_ANSWERS ? (uint16_t)(6 + count * (1 + EDGE_LINK_OUTPUTS)) : 0;
    case EDGE_LINK_HEARTBEAT:
      return 5 * 4 + 2 + EDGE_LINK_DIGEST_BYTES;
    default:
      return 0;
  }
}

static uint8_t countOf(const edgeLinkPacket_t *packet) {
  return packet->type == EDGE_LINK_FEATURES ? packet->features.count
                                            : (packet->type == EDGE_LINK_RESULT ? packet->result.count : 0);
}

static void putBody(writer_t *to, const edgeLinkPacket_t *packet) {
  const edgeLinkHeartbeat_t *beat = &packet->heartbeat;
  switch (packet->type) {
    case EDGE_LINK_RESET:
      put(to, packet->reset.nonce, 4);
      put(to, packet->reset.algorithm, 1);
      putBytes(to, packet->reset.digest, EDGE_LINK_DIGEST_BYTES);
      break;
    case EDGE_LINK_FEATURES:
      put(to, packet->features.back, 2);
      put(to, packet->features.count, 1);
      putBytes(to, packet->features.sample, (uint16_t)(packet->features.count * EDGE_LINK_SAMPLE_BYTES));
      break;
    case EDGE_LINK_RESULT:
      put(to, packet->result.expected, 4);
      put(to, packet->result.flags, 1);
      put(to, packet->result.count, 1);
      for (int i = 0; i < packet->result.count; i++) {
        put(to, packet->result.answer[i].back, 1);
        putBytes(to, packet->result.answer[i].output, EDGE_LINK_OUTPUTS);
      }
      break;
    default:
      put(to, beat->uptimeMs, 4);
      put(to, beat->expected, 4);
      put(to, beat->taken, 4);
      put(to, beat->lost, 4);
      put(to, beat->refused, 4);
      put(to, beat->algorithm, 1);
      put(to, beat->flags, 1);
      putBytes(to, beat->digest, EDGE_LINK_DIGEST_BYTES);
      break;
  }
}

uint16_t edgeLinkPack(const edgeLinkPacket_t *packet, uint8_t *bytes) {
  const uint16_t body = bodyBytes(packet->type, countOf(packet));
  if (body == 0) {
    return 0;
  }
  const uint16_t length = (uint16_t)(HEADER_BYTES + body + CRC_BYTES);
  writer_t to = {bytes};
  put(&to, EDGE_LINK_VERSION, 1);
  put(&to, packet->type, 1);
  put(&to, length, 1);
  put(&to, packet->session, 1);
  put(&to, packet->sequence, 4);
  putBody(&to, packet);
  put(&to, edgeLinkCrc(bytes, (uint16_t)(length - CRC_BYTES)), 2);
  return length;
}

static void getBody(reader_t *from, edgeLinkPacket_t *packet) {
  edgeLinkHeartbeat_t *beat = &packet->heartbeat;
  switch (packet->type) {
    case EDGE_LINK_RESET:
      packet->reset.nonce = get(from, 4);
      packet->reset.algorithm = (uint8_t)get(from, 1);
      getBytes(from, packet->reset.digest, EDGE_LINK_DIGEST_BYTES);
      break;
    case EDGE_LINK_FEATURES:
      packet->features.back = (uint16_t)get(from, 2);
      packet->features.count = (uint8_t)get(from, 1);
      getBytes(from, packet->features.sample, (uint16_t)(packet->features.count * EDGE_LINK_SAMPLE_BYTES));
      break;
    case EDGE_LINK_RESULT:
      packet->result.expected = get(from, 4);
      packet->result.flags = (uint8_t)get(from, 1);
      packet->result.count = (uint8_t)get(from, 1);
      for (int i = 0; i < packet->result.count; i++) {
        packet->result.answer[i].back = (uint8_t)get(from, 1);
        getBytes(from, packet->result.answer[i].output, EDGE_LINK_OUTPUTS);
      }
      break;
    default:
      beat->uptimeMs = get(from, 4);
      beat->expected = get(from, 4);
      beat->taken = get(from, 4);
      beat->lost = get(from, 4);
      beat->refused = get(from, 4);
      beat->algorithm = (uint8_t)get(from, 1);
      beat->flags = (uint8_t)get(from, 1);
      getBytes(from, beat->digest, EDGE_LINK_DIGEST_BYTES);
      break;
  }
}

bool edgeLinkParse(const uint8_t *bytes, uint16_t length, edgeLinkPacket_t *packet) {
  if (length < HEADER_BYTES + CRC_BYTES || length > EDGE_LINK_MAX_BYTES || bytes[0] != EDGE_LINK_VERSION ||
      bytes[2] != length) {
    return false;
  }
  const uint8_t type = bytes[1];
  const uint16_t body = (uint16_t)(length - HEADER_BYTES - CRC_BYTES);
  const uint16_t countAt = type == EDGE_LINK_FEATURES ? 2 : 5;
  const uint8_t count = body > countAt ? bytes[HEADER_BYTES + countAt] : 0;
  reader_t crc = {bytes + length - CRC_BYTES};
  if (bodyBytes(type, count) != body || get(&crc, 2) != edgeLinkCrc(bytes, (uint16_t)(length - CRC_BYTES))) {
    return false;
  }
  reader_t from = {bytes + 3};
  packet->type = type;
  packet->session = (uint8_t)get(&from, 1);
  packet->sequence = get(&from, 4);
  getBody(&from, packet);
  return true;
}

static uint8_t hexValue(char digit) {
  if (digit >= '0' && digit <= '9') {
    return (uint8_t)(digit - '0');
  }
  return (uint8_t)((digit | 0x20) - 'a' + 10);
}

void edgeLinkDigest(const char *sha256, uint8_t digest[EDGE_LINK_DIGEST_BYTES]) {
  for (int i = 0; i < EDGE_LINK_DIGEST_BYTES; i++) {
    digest[i] = (uint8_t)(hexValue(sha256[2 * i]) << 4 | hexValue(sha256[2 * i + 1]));
  }
}
