// The GAP8 app's core in sessions of all its algorithms, with packets that say anything; built with sanitizers by
// test_gap8_core.py.
//   gap8_driver hostile ROUNDS   whatever came before, a new session's replies are those of a new core
//   gap8_driver models           a network that does not fit is left out, and its sessions are refused
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "gap8_core.h"
#include "promise.h"
#include "stream_int8.h"

#define STEPS 300  // of a session without faults: longer than any window

static const gap8Models_t models = GAP8_EXPORTED;
static const struct {
  const char *sha256;
  uint8_t algorithm;
} sessions[GAP8_NETWORKS] = {{AIRTOUCH_STREAM_SHA256, EDGE_LINK_BEST},
                             {AIRTOUCH_MODEL_SHA256, EDGE_LINK_PAPER},
                             {AIRTOUCH_ROLLING_SHA256, EDGE_LINK_PAPER_STREAM}};
static void fill(void *to, size_t bytes) {
  for (size_t i = 0; i < bytes; i++) {
    ((uint8_t *)to)[i] = random8();
  }
}

// Three float32 of which some are no feature.
static void strangeFeatures(uint8_t sample[EDGE_LINK_SAMPLE_BYTES]) {
  static const uint32_t strange[] = {0x7fc00000u, 0x7f800000u, 0xff800000u, 0x7f800001u, 0xffffffffu, 0x00000001u,
                                     0x80000000u, 0x7f7fffffu, 0xff7fffffu, 0x00800000u, 0u};
  for (int i = 0; i < 3; i++) {
    uint32_t bits = strange[random8() % (sizeof strange / sizeof *strange)];
    if (random8() % 2) {
      fill(&bits, sizeof bits);
    }
    memcpy(sample + 4 * i, &bits, sizeof bits);
  }
}

static uint16_t resetPacket(int which, uint8_t session, uint32_t nonce, uint8_t *bytes) {
  edgeLinkPacket_t packet = {.type = EDGE_LINK_RESET, .session = session};
  packet.reset.nonce = nonce;
  packet.reset.algorithm = sessions[which].algorithm;
  edgeLinkDigest(sessions[which].sha256, packet.reset.digest);
  return edgeLinkPack(&packet, bytes);
}

// Exactly as much memory as the packet has, so that a byte too far is seen.
static uint16_t take(gap8Core_t *core, const uint8_t *bytes, uint16_t length, uint8_t *reply) {
  edgeLinkPacket_t packet;
  uint8_t *exact = malloc(length > 0 ? length : 1u);
  memcpy(exact, bytes, length);
  const uint16_t got = gap8CoreTake(core, exact, length, reply);
  free(exact);
  check(got == 0 || (edgeLinkParse(reply, got, &packet) && packet.type == EDGE_LINK_RESULT), "a reply is a RESULT");
  return got;
}

// A packet for the session that runs, with one thing or another wrong in it.
static uint16_t hostilePacket(uint8_t session, uint32_t *sequence, uint8_t *bytes) {
  edgeLinkPacket_t packet = {.type = EDGE_LINK_FEATURES, .session = session, .sequence = *sequence};
  packet.features.count = (uint8_t)(1 + random8() % EDGE_LINK_SAMPLES);
  packet.features.back = random8() % 4 ? 0 : (uint16_t)(random8() << 8 | random8());
  for (int i = 0; i < packet.features.count; i++) {
    strangeFeatures(packet.features.sample[i]);
  }
  if (random8() % 8 == 0) {
    fill(&packet.sequence, sizeof packet.sequence);
  } else {
    *sequence += packet.features.count + (random8() % 16 == 0 ? random8() : 0);
  }
  uint16_t length = edgeLinkPack(&packet, bytes);
  const uint8_t fault = random8() % 32;
  if (fault == 0) {
    length = (uint16_t)(random8() % (length + 1));
  } else if (fault == 1) {
    bytes[random8() % length] ^= (uint8_t)(1 + random8() % 255);
  } else if (fault == 2) {
    length = (uint16_t)(random8() % (EDGE_LINK_MAX_BYTES + 1));
    fill(bytes, length);
  } else if (fault < 6 && length > 4) {  // any type, length and count, with a CRC that is right
    bytes[1] = (uint8_t)(random8() % 6);
    bytes[8 + random8() % 8] = random8();
    length = (uint16_t)(10 + random8() % (EDGE_LINK_MAX_BYTES - 9));
    bytes[2] = (uint8_t)length;
    const uint16_t crc = edgeLinkCrc(bytes, (uint16_t)(length - 2));
    bytes[length - 2] = (uint8_t)crc;
    bytes[length - 1] = (uint8_t)(crc >> 8);
  }
  return length;
}

// A session without faults. @return a sum over all replies
static uint32_t cleanSession(gap8Core_t *core, int which, uint8_t session, uint32_t nonce, int *answers) {
  uint8_t bytes[EDGE_LINK_MAX_BYTES], reply[EDGE_LINK_MAX_BYTES];
  uint32_t sum = 0;
  check(take(core, bytes, resetPacket(which, session, nonce, bytes), reply) > 0, "a reset is answered");
  for (int i = 0; i < STEPS; i++) {
    edgeLinkPacket_t packet = {.type = EDGE_LINK_FEATURES, .session = session, .sequence = (uint32_t)i};
    packet.features.count = 1;
    for (int c = 0; c < 3; c++) {
      const float value = (float)((i * (7 + c) * 131) % 977 + 1) * 40.0f;
      memcpy(packet.features.sample[0] + 4 * c, &value, sizeof value);
    }
    const uint16_t length = take(core, bytes, edgeLinkPack(&packet, bytes), reply);
    check(length > 0 && edgeLinkParse(reply, length, &packet), "samples are answered");
    *answers += packet.result.count;
    for (uint16_t b = 0; b < length; b++) {
      sum = sum * 31u + reply[b];
    }
  }
  return sum;
}

static void hostile(int rounds) {
  static gap8Core_t core, fresh;
  uint8_t bytes[EDGE_LINK_MAX_BYTES], reply[EDGE_LINK_MAX_BYTES];
  long packets = 0;
  int answers = 0;
  check(gap8CoreInit(&core, &models, NULL) == GAP8_NETWORKS, "all networks fit");
  for (int round = 0; round < rounds; round++) {
    const int which = round % GAP8_NETWORKS;
    const uint8_t session = (uint8_t)(1 + 2 * round % 254);
    uint32_t sequence = 0;
    take(&core, bytes, resetPacket(which, session, (uint32_t)round, bytes), reply);
    for (int i = 0; i < 300; i++, packets++) {
      take(&core, bytes, hostilePacket(session, &sequence, bytes), reply);
      check(i % 50 || gap8CoreHeartbeat(&core, noise, reply) > 0, "a heartbeat is packed");
    }
    const int next = (round / GAP8_NETWORKS + round) % GAP8_NETWORKS;  // all pairs of algorithms follow each other
    gap8CoreInit(&fresh, &models, NULL);
    check(cleanSession(&core, next, (uint8_t)(session + 1), noise, &answers) ==
              cleanSession(&fresh, next, (uint8_t)(session + 1), noise, &answers),
          "a new session begins as on a new core");
  }
  printf("%ld packets, %d answers\n", packets, answers);
}

static bool refused(const gap8Models_t *offered, int which) {
  static gap8Core_t core;
  uint8_t bytes[EDGE_LINK_MAX_BYTES], reply[EDGE_LINK_MAX_BYTES];
  edgeLinkPacket_t packet;
  check(gap8CoreInit(&core, offered, NULL) == GAP8_NETWORKS - 1, "one network is left out");
  for (int i = 0; i < GAP8_NETWORKS; i++) {
    const uint16_t length = take(&core, bytes, resetPacket(i, (uint8_t)(i + 1), 5, bytes), reply);
    check(length > 0 && edgeLinkParse(reply, length, &packet), "a reset is answered");
    if (!!(packet.result.flags & EDGE_LINK_MISMATCH) != (i == which)) {
      return false;
    }
  }
  return true;
}

static void wrongModels(void) {
  streamConv_t convs[STREAM_MAX_CONVS];
  layerInt8_t layers[8], head = *airtouchStream.head;
  streamInt8_t stream = airtouchStream;
  networkInt8_t window = airtouchNetwork, rolling = airtouchRolling;
  fixedScale_t scale = airtouchRollingScale;
  memcpy(convs, airtouchStream.convs, (size_t)airtouchStream.convCount * sizeof *convs);
  stream.convs = convs;
  stream.head = &head;
  gap8Models_t offered = models;
  offered.best = &stream;
  convs[1].dilation += 64;  // more past than there is memory for
  check(refused(&offered, 0), "a stream that needs more memory");
  convs[1].dilation -= 64;
  convs[0].layer.inChannels = 20;  // more values than a sample has
  check(refused(&offered, 0), "a stream of larger samples");
  convs[0].layer.inChannels = 12;
  head.outChannels = 2;  // fewer than an answer is made of
  check(refused(&offered, 0), "a stream with fewer outputs");
  offered = models;
  offered.paper = &window;
  memcpy(layers, airtouchNetwork.layers, (size_t)airtouchNetwork.layerCount * sizeof *layers);
  window.layers = layers;
  window.layerCount = 0;
  check(refused(&offered, 1), "a network without layers");
  window.layerCount = airtouchNetwork.layerCount - 1;
  check(refused(&offered, 1), "a network with other outputs");
  window.layerCount++;
  layers[0].inRows++;
  layers[0].outRows++;
  check(refused(&offered, 1), "a network of longer windows");
  offered = models;
  offered.paperStream = &rolling;
  memcpy(layers, airtouchRolling.layers, (size_t)airtouchRolling.layerCount * sizeof *layers);
  rolling.layers = layers;
  layers[1].kernelRows = 3;  // its rows come at another stride
  layers[1].outRows = layers[1].inRows / 3;
  check(refused(&offered, 2), "a network of another stride");
  offered = models;
  offered.paperStreamScale = &scale;
  scale.columns = 4;
  check(refused(&offered, 2), "a scale of more features");
  printf("8 refused\n");
}

int main(int argc, char **argv) {
  if (argc == 3 && strcmp(argv[1], "hostile") == 0) {
    hostile(atoi(argv[2]));
  } else {
    wrongModels();
  }
  return 0;
}
