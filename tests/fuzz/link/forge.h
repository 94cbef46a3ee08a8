/**
 * @file forge.h
 * Packets with a right CRC that say anything: what another program on the wire could send.
 */
#pragma once

#include "edge_link.h"
#include "fuzz.h"

/** A session: mostly the one that counts. */
static inline uint8_t takeSession(bytes_t *bytes, uint8_t right) {
  const uint8_t code = takeByte(bytes);
  return code < 192 ? right : (uint8_t)(right + code);
}

/** A sequence: mostly near the one that counts, now and then a quarter or half of all numbers away. */
static inline uint32_t takeSequence(bytes_t *bytes, uint32_t near) {
  const uint8_t code = takeByte(bytes);
  if (code < 208) {
    return near + code - 160u;
  }
  return code < 240 ? near + ((uint32_t)code << 26) : takeWord(bytes);
}

/**
 * A packet of the type that @p kind names.
 * @param session  the one that counts
 * @param near     the sequence that counts
 * @param digest   of the model that counts
 * @return its length in @p packed, EDGE_LINK_MAX_BYTES of room
 */
static inline uint16_t forge(bytes_t *bytes, uint8_t kind, uint8_t session, uint32_t near, const uint8_t *digest,
                             uint8_t *packed) {
  edgeLinkPacket_t packet = {.type = (uint8_t)(EDGE_LINK_RESET + kind % 4)};
  packet.session = takeSession(bytes, session);
  packet.sequence = takeSequence(bytes, near);
  switch (packet.type) {
    case EDGE_LINK_RESET:
      packet.reset.nonce = takeByte(bytes);
      packet.reset.algorithm = (uint8_t)(takeByte(bytes) % 4);
      memcpy(packet.reset.digest, digest, EDGE_LINK_DIGEST_BYTES);
      packet.reset.digest[0] ^= takeByte(bytes) < 192 ? 0 : 1;
      break;
    case EDGE_LINK_FEATURES: {
      const uint8_t back = takeByte(bytes);
      packet.features.back = (uint16_t)(back < 240 ? back : back * 273u);
      packet.features.count = (uint8_t)takeBetween(bytes, 1, EDGE_LINK_SAMPLES);
      for (int i = 0; i < packet.features.count; i++) {
        memset(packet.features.sample[i], takeByte(bytes), EDGE_LINK_SAMPLE_BYTES);
      }
      break;
    }
    case EDGE_LINK_RESULT:
      packet.result.expected = takeSequence(bytes, near);
      packet.result.flags = (uint8_t)(takeByte(bytes) & takeByte(bytes));
      packet.result.count = (uint8_t)takeBelow(bytes, EDGE_LINK_ANSWERS + 1);
      for (int i = 0; i < packet.result.count; i++) {
        packet.result.answer[i].back = takeByte(bytes);
        memset(packet.result.answer[i].output, packet.result.answer[i].back, EDGE_LINK_OUTPUTS);
      }
      break;
    default:
      packet.heartbeat.uptimeMs = takeByte(bytes);
      packet.heartbeat.algorithm = EDGE_LINK_BEST;
      break;
  }
  return edgeLinkPack(&packet, packed);
}

/** The sample of a sequence, where a target makes them up. */
typedef void sampleOf_t(uint32_t sequence, uint8_t sample[EDGE_LINK_SAMPLE_BYTES]);

/** Gives a packet of samples the true ones of its sequences; leaves other bytes alone. @return the length */
static inline uint16_t withSamples(uint8_t *packed, uint16_t length, sampleOf_t *sampleOf) {
  edgeLinkPacket_t packet;
  if (!edgeLinkParse(packed, length, &packet) || packet.type != EDGE_LINK_FEATURES) {
    return length;
  }
  for (uint32_t i = 0; i < packet.features.count; i++) {
    sampleOf(packet.sequence + i, packet.features.sample[i]);
  }
  return edgeLinkPack(&packet, packed);
}

/** A packet of samples from @p first on. */
static inline uint16_t packSamples(uint8_t session, uint32_t first, int count, uint16_t back, sampleOf_t *sampleOf,
                                   uint8_t *packed) {
  edgeLinkPacket_t packet = {.type = EDGE_LINK_FEATURES, .session = session, .sequence = first};
  packet.features.count = (uint8_t)count;
  packet.features.back = back;
  for (int i = 0; i < count; i++) {
    sampleOf(first + (uint32_t)i, packet.features.sample[i]);
  }
  return edgeLinkPack(&packet, packed);
}

/** A packet that begins a session. */
static inline uint16_t packReset(uint8_t session, uint32_t nonce, uint8_t algorithm, const uint8_t *digest,
                                 uint8_t *packed) {
  edgeLinkPacket_t packet = {.type = EDGE_LINK_RESET, .session = session};
  packet.reset.nonce = nonce;
  packet.reset.algorithm = algorithm;
  memcpy(packet.reset.digest, digest, EDGE_LINK_DIGEST_BYTES);
  return edgeLinkPack(&packet, packed);
}
