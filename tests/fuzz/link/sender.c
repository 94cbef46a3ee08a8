// link_sender.h alone: samples, polls, a transport that refuses, and packets from the other side that are raw bytes or
// forged with a right CRC. Whatever was said, counters only grow, what is sent is true, and a GAP8 that starts then
// gets a stream and its answers are accepted.
#include "forge.h"
#include "link_sender.h"
#include "packet_table.h"
#include "toy_network.h"

#define STEPS 1200
#define SETTLE \
  (LINK_RETRY_MOST + LINK_REFUSED_STEPS + 2 * LINK_DOWN_STEPS)  // steps until a GAP8 that starts is taken up

static const uint8_t digest[EDGE_LINK_DIGEST_BYTES] = {9, 8, 7, 6, 5, 4, 3, 2};
static linkSender_t *sender;
static uint32_t seed, pushed;

static void sampleOf(uint32_t sequence, uint8_t sample[EDGE_LINK_SAMPLE_BYTES]) {
  const uint32_t word = (sequence + 1) * 2654435761u ^ seed;
  memset(sample, 0, EDGE_LINK_SAMPLE_BYTES);
  memcpy(sample, &word, sizeof word);
}

static void push(void) {
  uint8_t sample[EDGE_LINK_SAMPLE_BYTES];
  sampleOf(pushed++, sample);
  linkSenderPush(sender, sample);
}

static void checkSamples(const edgeLinkPacket_t *packet) {
  const edgeLinkFeatures_t *features = &packet->features;
  CHECK(packet->sequence + features->count <= pushed, "only samples that were taken are sent");
  CHECK(pushed - (packet->sequence - features->back) <= LINK_HISTORY, "what can be sent again is still kept");
  for (uint32_t i = 0; i < features->count; i++) {
    uint8_t sample[EDGE_LINK_SAMPLE_BYTES];
    sampleOf(packet->sequence + i, sample);
    CHECK(memcmp(sample, features->sample[i], sizeof sample) == 0, "samples are sent as they were taken");
  }
}

/** @return the length of the packet in @p packed, 0 for none */
static uint16_t poll(uint8_t *packed) {
  edgeLinkPacket_t packet;
  const uint16_t length = linkSenderPoll(sender, packed);
  CHECK(length == 0 || (inTable(packed, length) && edgeLinkParse(packed, length, &packet)), "what is sent is a packet");
  if (length > 0) {
    CHECK(packet.session == sender->session && packet.session != 0, "it names the session");
    CHECK(packet.type == EDGE_LINK_RESET || packet.type == EDGE_LINK_FEATURES, "it resets, or carries samples");
    if (packet.type == EDGE_LINK_FEATURES) {
      checkSamples(&packet);
    }
  }
  return length;
}

static void checkCounters(const linkCounters_t *before) {
  const linkCounters_t *now = &sender->counters;
  CHECK(now->sent >= before->sent && now->packetsDropped >= before->packetsDropped &&
            now->received >= before->received && now->packetsRefused >= before->packetsRefused &&
            now->timeouts >= before->timeouts && now->rewinds >= before->rewinds &&
            now->samplesLost >= before->samplesLost && now->resets >= before->resets,
        "counters only grow");
  CHECK(linkSenderBacklog(sender) <= LINK_HISTORY && sender->state <= LINK_REFUSED && sender->samples == pushed,
        "a state that there is");
}

/** @return how many answers were accepted */
static int take(const uint8_t *packet, uint16_t length) {
  linkAnswer_t answers[EDGE_LINK_ANSWERS];
  uint8_t *exact = exactCopy(packet, length);
  const linkCounters_t before = sender->counters;
  const int count = linkSenderTake(sender, exact, length, answers);
  edgeLinkPacket_t read;
  const bool known =
      edgeLinkParse(exact, length, &read) && (read.type == EDGE_LINK_RESULT || read.type == EDGE_LINK_HEARTBEAT);
  CHECK(sender->counters.packetsRefused - before.packetsRefused == !known &&
            sender->counters.received - before.received == known,
        "a packet is taken or refused, and counted");
  CHECK(count >= 0 && count <= EDGE_LINK_ANSWERS, "answers fit their room");
  for (int i = 0; i < count; i++) {
    CHECK(edgeLinkAfter(pushed, answers[i].sequence) > 0, "an answer is to a sample that was taken");
    CHECK(i == 0 || edgeLinkAfter(answers[i].sequence, answers[i - 1].sequence) > 0, "answers are in order");
  }
  free(exact);
  return count;
}

static void doOne(bytes_t *bytes) {
  uint8_t packed[EDGE_LINK_MAX_BYTES + 30] = {0};
  const uint8_t what = takeByte(bytes);
  switch (what % 8) {
    case 0:
      for (int i = what / 8; i >= 0; i--) {
        push();
      }
      break;
    case 1:
    case 2:
      push();
      for (int i = 0; i < 2 && poll(packed) > 0; i++) {
        linkSenderSent(sender, what < 240);
      }
      break;
    case 3: {
      const uint16_t length = (uint16_t)takeBelow(bytes, sizeof packed);
      takeInto(bytes, packed, length);
      take(packed, length);
      break;
    }
    case 4: {  // an answer that was found without the GAP8, to a sample that was taken
      const uint32_t back = 1u + takeByte(bytes);
      if (back <= pushed) {
        linkSenderAccept(sender, pushed - back);
      }
      break;
    }
    case 5: take(packed, forge(bytes, what / 8, sender->session, pushed, digest, packed)); break;
    default:  // results most of all
      take(packed, forge(bytes, EDGE_LINK_RESULT - 1, sender->session, pushed, digest, packed));
      break;
  }
}

/** A GAP8 that just started, and a pipe without faults: the link comes up, and every sample gets its answer. */
static void join(uint16_t window) {
  toyNetwork_t toy = toyMake(window, 1);
  const linkNetwork_t network = toyAsNetwork(&toy, EDGE_LINK_BEST, digest);
  linkReceiver_t receiver;
  linkReceiverInit(&receiver, &network, 1);
  for (int good = 0, steps = 0; good < 20; steps++) {
    uint8_t packed[EDGE_LINK_MAX_BYTES], reply[EDGE_LINK_MAX_BYTES];
    int answers = 0;
    push();
    for (int k = 0; k < 2 && poll(packed) > 0; k++) {
      linkSenderSent(sender, true);
      answers += take(reply, linkReceiverTake(&receiver, packed, packed[2], reply));
    }
    good = answers == 1 && sender->state == LINK_UP ? good + 1 : 0;
    CHECK(steps < SETTLE + window, "a GAP8 that starts is taken up, whatever was said before");
  }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  bytes_t bytes = {data, size};
  const uint8_t shape = takeByte(&bytes);
  const uint16_t window = (uint16_t)(1 + shape % 64);
  seed = shape;
  pushed = 0;
  sender = rubbish(sizeof *sender, 0xa5);
  linkSenderInit(sender, EDGE_LINK_BEST, digest, shape < 250 ? window : UINT16_MAX, shape, takeByte(&bytes));
  CHECK(sender->session != 0, "a session has a number");
  while (bytes.left > 0 && pushed < STEPS) {
    const linkCounters_t before = sender->counters;
    doOne(&bytes);
    checkCounters(&before);
  }
  join(window);
  free(sender);
  return 0;
}
