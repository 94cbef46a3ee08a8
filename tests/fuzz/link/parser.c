// edge_link.h: the parser takes any bytes of any length, accepts exactly the packets of the table, and reads what
// edgeLinkPack() wrote.
#include "packet_table.h"

#define ROOM 320  // beyond the longest packet and beyond what one byte of length can say

static bool sameBody(const edgeLinkPacket_t *a, const edgeLinkPacket_t *b) {
  switch (a->type) {
    case EDGE_LINK_RESET:
      return a->reset.nonce == b->reset.nonce && a->reset.algorithm == b->reset.algorithm &&
             memcmp(a->reset.digest, b->reset.digest, EDGE_LINK_DIGEST_BYTES) == 0;
    case EDGE_LINK_FEATURES:
      return a->features.back == b->features.back && a->features.count == b->features.count &&
             memcmp(a->features.sample, b->features.sample, (size_t)a->features.count * EDGE_LINK_SAMPLE_BYTES) == 0;
    case EDGE_LINK_RESULT:
      return a->result.expected == b->result.expected && a->result.flags == b->result.flags &&
             a->result.count == b->result.count &&
             memcmp(a->result.answer, b->result.answer, a->result.count * sizeof a->result.answer[0]) == 0;
    default: {
      const edgeLinkHeartbeat_t *x = &a->heartbeat, *y = &b->heartbeat;
      return x->uptimeMs == y->uptimeMs && x->expected == y->expected && x->samplesTaken == y->samplesTaken &&
             x->samplesLost == y->samplesLost && x->packetsRefused == y->packetsRefused &&
             x->algorithm == y->algorithm && x->flags == y->flags &&
             memcmp(x->digest, y->digest, EDGE_LINK_DIGEST_BYTES) == 0;
    }
  }
}

static bool samePacket(const edgeLinkPacket_t *a, const edgeLinkPacket_t *b) {
  return a->type == b->type && a->session == b->session && a->sequence == b->sequence && sameBody(a, b);
}

static void readBytes(bytes_t *bytes, uint8_t mend) {
  uint8_t raw[ROOM];
  edgeLinkPacket_t packet;
  const uint16_t length = (uint16_t)(mend & 8 ? takeBelow(bytes, ROOM) : (bytes->left < ROOM ? bytes->left : ROOM));
  takeInto(bytes, raw, length);
  if ((mend & 1) && length > 0) {
    raw[0] = EDGE_LINK_VERSION;
  }
  if ((mend & 2) && length > 2) {
    raw[2] = (uint8_t)length;
  }
  if (mend & 4) {
    mendCrc(raw, length);
  }
  uint8_t *exact = exactCopy(raw, length);
  const bool accepted = edgeLinkParse(exact, length, &packet);
  CHECK(accepted == inTable(raw, length), "the parser accepts the packets of the table, no more and no less");
  if (accepted) {
    uint8_t *again = rubbish(EDGE_LINK_MAX_BYTES, 0xa5);
    CHECK(edgeLinkPack(&packet, again) == length && memcmp(again, exact, length) == 0,
          "a packet that was accepted is one that edgeLinkPack() writes, byte for byte");
    free(again);
  }
  free(exact);
}

static void writePacket(bytes_t *bytes) {
  edgeLinkPacket_t packet, back;
  takeInto(bytes, &packet, sizeof packet);
  packet.type = (uint8_t)(packet.type % 6);
  const bool features = packet.type == EDGE_LINK_FEATURES, result = packet.type == EDGE_LINK_RESULT;
  const bool right = packet.type >= 1 && packet.type <= 4 &&
                     (!features || (packet.features.count >= 1 && packet.features.count <= EDGE_LINK_SAMPLES)) &&
                     (!result || packet.result.count <= EDGE_LINK_ANSWERS);
  uint8_t *written = rubbish(EDGE_LINK_MAX_BYTES, 0x5a);
  const uint16_t length = edgeLinkPack(&packet, written);
  CHECK((length > 0) == right && length <= EDGE_LINK_MAX_BYTES,
        "a packet of a known type with a right count is written");
  if (length > 0) {
    uint8_t *exact = exactCopy(written, length);
    CHECK(inTable(exact, length), "what is written is in the table");
    CHECK(edgeLinkParse(exact, length, &back) && samePacket(&packet, &back), "what is written is read again");
    const uint32_t flipped = takeBelow(bytes, 8u * length);
    exact[flipped / 8] ^= (uint8_t)(1u << flipped % 8);
    CHECK(!edgeLinkParse(exact, length, &back), "a changed bit is seen");
    CHECK(!edgeLinkParse(written, (uint16_t)(length - 1), &back), "a lost byte is seen");
    free(exact);
  }
  free(written);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  bytes_t bytes = {data, size};
  const uint8_t mode = takeByte(&bytes);
  if (mode & 16) {
    writePacket(&bytes);
  } else {
    readBytes(&bytes, mode);
  }
  return 0;
}
