// Packets with a right CRC, each in exactly as much memory as it has, so that a byte too far is seen; built with
// sanitizers by test_packets.py. What can be read must be packed again into the same bytes.
//   packet_driver counts      every type, length and count
//   packet_driver FILE ...    records: whether it is a packet (1), length (1), bytes
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "gap8_core.h"
#include "link_sender.h"

#define LONGEST 140

static gap8Core_t gap8;
static linkSender_t sender;
static long accepted, refused;

static void check(bool good, const char *what, const uint8_t *bytes, uint16_t length) {
  if (!good) {
    fprintf(stderr, "broken promise: %s:", what);
    for (int i = 0; i < length; i++) {
      fprintf(stderr, " %02x", bytes[i]);
    }
    abort();
  }
}

static void start(void) {
  uint8_t digest[EDGE_LINK_DIGEST_BYTES];
  static const gap8Models_t models = GAP8_EXPORTED;
  gap8CoreInit(&gap8, &models, NULL);
  edgeLinkDigest(AIRTOUCH_STREAM_SHA256, digest);
  linkSenderInit(&sender, EDGE_LINK_BEST, digest, 300, 7, 1);
}

// The parser and both ends take a packet.
static void take(const uint8_t *bytes, uint16_t length, bool isPacket) {
  linkAnswer_t answers[EDGE_LINK_ANSWERS];
  uint8_t packed[EDGE_LINK_MAX_BYTES], reply[EDGE_LINK_MAX_BYTES];
  uint8_t *exact = malloc(length > 0 ? length : 1u);
  edgeLinkPacket_t *packet = malloc(sizeof *packet);
  memcpy(exact, bytes, length);
  check(edgeLinkParse(exact, length, packet) == isPacket, isPacket ? "a packet is read" : "no packet is refused", bytes,
        length);
  if (isPacket) {
    check(edgeLinkPack(packet, packed) == length && memcmp(packed, bytes, length) == 0, "it packs to the same bytes",
          bytes, length);
  }
  check(gap8CoreTake(&gap8, exact, length, reply) <= EDGE_LINK_MAX_BYTES, "a reply fits a packet", bytes, length);
  check(linkSenderTake(&sender, exact, length, answers) <= EDGE_LINK_ANSWERS, "answers fit their room", bytes, length);
  free(packet);
  free(exact);
  accepted += isPacket;
  refused += !isPacket;
}

// Whether host/docs/link.md has a packet of this type and length with this count.
static bool documented(int type, int length, int count) {
  switch (type) {
    case 1: return length == 10 + 13;
    case 2: return count >= 1 && count <= 7 && length == 10 + 3 + 12 * count;
    case 3: return count <= 7 && length == 10 + 6 + 4 * count;
    case 4: return length == 10 + 30;
    default: return false;
  }
}

static void everyCount(void) {
  static const uint8_t types[] = {0, 1, 2, 3, 4, 5, 6, 127, 128, 255};
  uint8_t bytes[LONGEST];
  for (size_t t = 0; t < sizeof types; t++) {
    const int at = types[t] == EDGE_LINK_FEATURES ? 10 : 13;
    for (int length = 0; length < LONGEST; length++) {
      for (int count = 0; count < 256; count++) {
        for (int i = 0; i < length; i++) {
          bytes[i] = (uint8_t)(31 * i + count);
        }
        const uint8_t head[8] = {EDGE_LINK_VERSION, types[t], (uint8_t)length, (uint8_t)(1 + count % 2)};
        memcpy(bytes, head, length < 8 ? (size_t)length : sizeof head);
        if (length > at) {
          bytes[at] = (uint8_t)count;
        }
        if (length >= 2) {
          const uint16_t crc = edgeLinkCrc(bytes, (uint16_t)(length - 2));
          bytes[length - 2] = (uint8_t)crc;
          bytes[length - 1] = (uint8_t)(crc >> 8);
        }
        take(bytes, (uint16_t)length, documented(types[t], length, count));
      }
    }
  }
}

static void records(const char *path) {
  static uint8_t data[1 << 20];
  FILE *file = fopen(path, "rb");
  check(file != NULL, path, NULL, 0);
  const size_t size = fread(data, 1, sizeof data, file);
  fclose(file);
  for (size_t at = 0; at + 2 <= size; at += 2u + data[at + 1]) {
    take(data + at + 2, data[at + 1], data[at]);
  }
}

int main(int argc, char **argv) {
  start();
  for (int i = 1; i < argc; i++) {
    if (strcmp(argv[i], "counts") == 0) {
      everyCount();
    } else {
      records(argv[i]);
    }
  }
  printf("%ld packets read, %ld refused\n", accepted, refused);
  return 0;
}
