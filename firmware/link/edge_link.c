#include "edge_link.h"

#include <string.h>

#define HEADER_BYTES 8
#define CRC_BYTES 2

/** Where the next number is written. */
typedef struct {
  uint8_t *at;
} writer_t;

/** What is left to read. A read of more than that reads nothing, gives 0, and is remembered. */
typedef struct {
  const uint8_t *at;
  uint16_t left;
  bool tooShort;  ///< there was less than was asked for
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

static bool has(reader_t *from, uint16_t bytes) {
  from->tooShort = from->tooShort || bytes > from->left;
  return !from->tooShort;
}

static uint32_t get(reader_t *from, uint16_t bytes) {
  uint32_t value = 0;
  if (!has(from, bytes)) {
    return 0;
  }
  for (uint16_t i = 0; i < bytes; i++) {
    value |= (uint32_t)from->at[i] << (8 * i);
  }
  from->at += bytes;
  from->left = (uint16_t)(from->left - bytes);
  return value;
}

static void getBytes(reader_t *from, void *to, uint16_t bytes) {
  if (has(from, bytes)) {
    memcpy(to, from->at, bytes);
    from->at += bytes;
    from->left = (uint16_t)(from->left - bytes);
  }
}

/** The length of a body to be written; false where there is none of this type with this count. */
static bool bodyLength(const edgeLinkPacket_t *packet, uint16_t *bytes) {
  switch (packet->type) {
    case EDGE_LINK_RESET: *bytes = 4 + 1 + EDGE_LINK_DIGEST_BYTES; return true;
    case EDGE_LINK_FEATURES:
      *bytes = (uint16_t)(3 + packet->features.count * EDGE_LINK_SAMPLE_BYTES);
      return packet->features.count >= 1 && packet->features.count <= EDGE_LINK_SAMPLES;
    case EDGE_LINK_RESULT:
      *bytes = (uint16_t)(6 + packet->result.count * (1 + EDGE_LINK_OUTPUTS));
      return packet->result.count <= EDGE_LINK_ANSWERS;
    case EDGE_LINK_HEARTBEAT: *bytes = 5 * 4 + 2 + EDGE_LINK_DIGEST_BYTES; return true;
    default: return false;
  }
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
      put(to, beat->samplesTaken, 4);
      put(to, beat->samplesLost, 4);
      put(to, beat->packetsRefused, 4);
      put(to, beat->algorithm, 1);
      put(to, beat->flags, 1);
      putBytes(to, beat->digest, EDGE_LINK_DIGEST_BYTES);
      break;
  }
}

uint16_t edgeLinkPack(const edgeLinkPacket_t *packet, uint8_t *bytes) {
  uint16_t body;
  if (!bodyLength(packet, &body)) {
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

/** The samples of FEATURES; false for a count that it cannot have. */
static bool getFeatures(reader_t *from, edgeLinkFeatures_t *features) {
  features->back = (uint16_t)get(from, 2);
  features->count = (uint8_t)get(from, 1);
  if (features->count < 1 || features->count > EDGE_LINK_SAMPLES) {
    return false;
  }
  getBytes(from, features->sample, (uint16_t)(features->count * EDGE_LINK_SAMPLE_BYTES));
  return true;
}

/** The answers of RESULT; false for a count that it cannot have. */
static bool getResult(reader_t *from, edgeLinkResult_t *result) {
  result->expected = get(from, 4);
  result->flags = (uint8_t)get(from, 1);
  result->count = (uint8_t)get(from, 1);
  if (result->count > EDGE_LINK_ANSWERS) {
    return false;
  }
  for (int i = 0; i < result->count; i++) {
    result->answer[i].back = (uint8_t)get(from, 1);
    getBytes(from, result->answer[i].output, EDGE_LINK_OUTPUTS);
  }
  return true;
}

static void getHeartbeat(reader_t *from, edgeLinkHeartbeat_t *beat) {
  beat->uptimeMs = get(from, 4);
  beat->expected = get(from, 4);
  beat->samplesTaken = get(from, 4);
  beat->samplesLost = get(from, 4);
  beat->packetsRefused = get(from, 4);
  beat->algorithm = (uint8_t)get(from, 1);
  beat->flags = (uint8_t)get(from, 1);
  getBytes(from, beat->digest, EDGE_LINK_DIGEST_BYTES);
}

static void getReset(reader_t *from, edgeLinkReset_t *reset) {
  reset->nonce = get(from, 4);
  reset->algorithm = (uint8_t)get(from, 1);
  getBytes(from, reset->digest, EDGE_LINK_DIGEST_BYTES);
}

/** Reads a body; false for an unknown type or a count that it cannot have. */
static bool getBody(reader_t *from, edgeLinkPacket_t *packet) {
  switch (packet->type) {
    case EDGE_LINK_RESET: getReset(from, &packet->reset); return true;
    case EDGE_LINK_FEATURES: return getFeatures(from, &packet->features);
    case EDGE_LINK_RESULT: return getResult(from, &packet->result);
    case EDGE_LINK_HEARTBEAT: getHeartbeat(from, &packet->heartbeat); return true;
    default: return false;
  }
}

bool edgeLinkParse(const uint8_t *bytes, uint16_t length, edgeLinkPacket_t *packet) {
  if (length < HEADER_BYTES + CRC_BYTES || length > EDGE_LINK_MAX_BYTES) {
    return false;
  }
  const uint16_t end = (uint16_t)(length - CRC_BYTES);
  reader_t crc = {bytes + end, CRC_BYTES, false};
  reader_t from = {bytes, end, false};
  if (get(&crc, 2) != edgeLinkCrc(bytes, end) || get(&from, 1) != EDGE_LINK_VERSION) {
    return false;
  }
  packet->type = (uint8_t)get(&from, 1);
  if (get(&from, 1) != length) {
    return false;
  }
  packet->session = (uint8_t)get(&from, 1);
  packet->sequence = get(&from, 4);
  return getBody(&from, packet) && !from.tooShort && from.left == 0;
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
