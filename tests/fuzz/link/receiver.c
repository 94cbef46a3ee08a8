// link_receiver.h with two networks: raw bytes, and packets with a right CRC that say anything, a sample always
// carrying its own sequence. Promised: the network sees each sample of a session once and in order, every reply is a
// packet that answers the one that came, and what it says of a sample is what the network says.
#include "forge.h"
#include "link_receiver.h"
#include "packet_table.h"
#include "toy_network.h"

#define PACKETS 400

/** A toy that also checks the order of what it is given. */
typedef struct {
  toyNetwork_t toy;
  bool begun;
  uint32_t next;  ///< the sequence that must come
} watched_t;

static const uint8_t digests[2][EDGE_LINK_DIGEST_BYTES] = {{1}, {2}};
static watched_t watched[2];
static linkReceiver_t *receiver;

static void watchedReset(void *context) {
  watched_t *one = context;
  toyReset(&one->toy);
  one->begun = false;
}

static bool watchedStep(void *context, const uint8_t sample[EDGE_LINK_SAMPLE_BYTES], int8_t output[EDGE_LINK_OUTPUTS]) {
  watched_t *one = context;
  uint32_t sequence;
  memcpy(&sequence, sample, sizeof sequence);
  CHECK(!one->begun || sequence == one->next, "the network sees each sample once and in order");
  CHECK(one->begun || sequence % one->toy.stride == 0, "it begins on a multiple of its stride");
  one->begun = true;
  one->next = sequence + 1;
  return toyStep(&one->toy, sample, output);
}

static void setSample(uint32_t sequence, uint8_t sample[EDGE_LINK_SAMPLE_BYTES]) {
  const uint32_t words[3] = {sequence, sequence * 2654435761u, 0};
  memcpy(sample, words, sizeof words);
}

/** The answer of a network that has seen the whole window before `sequence`, and that sample. */
static void truth(const toyNetwork_t *toy, uint32_t sequence, int8_t output[EDGE_LINK_OUTPUTS]) {
  uint32_t hash = 0;
  for (uint32_t i = 0; i < toy->window; i++) {
    uint8_t sample[EDGE_LINK_SAMPLE_BYTES];
    setSample(sequence + 1 - toy->window + i, sample);
    hash = hash * TOY_BASE + toyHash(sample);
  }
  toyOutput(hash, output);
}

static void checkAnswers(const edgeLinkResult_t *result) {
  const toyNetwork_t *toy = &((watched_t *)receiver->network->context)->toy;
  for (int i = 0; i < result->count; i++) {
    const edgeLinkAnswer_t *answer = &result->answer[i];
    int8_t right[EDGE_LINK_OUTPUTS];
    CHECK(answer->back >= 1 && (i == 0 || answer->back < result->answer[i - 1].back), "answers are in order");
    truth(toy, result->expected - answer->back, right);
    CHECK(memcmp(right, answer->output, sizeof right) == 0, "an answer is what the network says of that sample");
  }
}

/** What came is a packet of a session, or none: the reply must fit it. */
static void checkReply(const edgeLinkPacket_t *asked, const uint8_t *reply, uint16_t length, uint32_t expected) {
  edgeLinkPacket_t said;
  CHECK(inTable(reply, length) && edgeLinkParse(reply, length, &said) && said.type == EDGE_LINK_RESULT,
        "the reply is a result");
  CHECK(said.session == asked->session && said.sequence == asked->sequence, "it names what it answers");
  const edgeLinkResult_t *result = &said.result;
  const bool known = asked->session != 0 && asked->session == receiver->session;
  CHECK(((result->flags & EDGE_LINK_UNKNOWN) != 0) == !known || receiver->network == NULL,
        "an unknown session is called so");
  if (!known || receiver->network == NULL) {
    CHECK(result->count == 0, "no answers without a network");
    return;
  }
  CHECK(result->expected == receiver->expected, "it says what is expected");
  CHECK(!(result->flags & EDGE_LINK_GAP) || receiver->expected == expected ||
            edgeLinkAfter(asked->sequence, result->expected) > 0,
        "nothing is taken behind a gap");
  const bool behind = asked->type == EDGE_LINK_FEATURES && edgeLinkAfter(asked->sequence, result->expected) > 0;
  CHECK(((result->flags & EDGE_LINK_GAP) != 0) == behind, "samples behind a gap are asked for");
  CHECK(!(result->flags & EDGE_LINK_FILLING) || result->count == 0, "no answers before a whole window");
  checkAnswers(result);
}

static void deliver(const uint8_t *packet, uint16_t length) {
  uint8_t *exact = exactCopy(packet, length);
  uint8_t *reply = rubbish(EDGE_LINK_MAX_BYTES, 0x5a);
  const linkReceiver_t before = *receiver;
  const uint32_t steps = watched[0].toy.steps + watched[1].toy.steps;
  const uint16_t size = linkReceiverTake(receiver, exact, length, reply);
  edgeLinkPacket_t asked;
  const bool known =
      edgeLinkParse(exact, length, &asked) && (asked.type == EDGE_LINK_RESET || asked.type == EDGE_LINK_FEATURES);
  CHECK((size > 0) == known && receiver->packetsRefused - before.packetsRefused == !known,
        "every packet is answered or refused");
  CHECK(receiver->samplesTaken >= before.samplesTaken && receiver->samplesLost >= before.samplesLost &&
            receiver->samplesRepeated >= before.samplesRepeated,
        "counters only grow");
  CHECK(receiver->samplesTaken - before.samplesTaken <= EDGE_LINK_SAMPLES, "a packet holds seven samples at most");
  CHECK(watched[0].toy.steps + watched[1].toy.steps - steps <= receiver->samplesTaken - before.samplesTaken,
        "no sample is used twice");
  if (known) {
    checkReply(&asked, reply, size, before.expected);
  }
  free(reply);
  free(exact);
}

static void send(uint32_t first, int count, uint16_t back) {
  uint8_t packed[EDGE_LINK_MAX_BYTES];
  deliver(packed, packSamples(receiver->session, first, count, back, setSample, packed));
}

static void doOne(bytes_t *bytes) {
  uint8_t packed[EDGE_LINK_MAX_BYTES + 30] = {0};
  const uint8_t what = takeByte(bytes);
  const uint32_t near = receiver->expected;
  uint16_t length;
  bool spoken;
  switch (what % 8) {
    case 0:
      length = (uint16_t)takeBelow(bytes, sizeof packed);
      takeInto(bytes, packed, length);
      deliver(packed, withSamples(packed, length, setSample));
      break;
    case 1:
      deliver(packed, forge(bytes, EDGE_LINK_RESET - 1, receiver->session, near, digests[what / 8 % 2], packed));
      break;
    case 2:
      spoken = receiver->beats > 0;
      length = linkReceiverHeartbeat(receiver, what, packed);
      CHECK((length > 0) == spoken, "a heartbeat comes while the STM32 speaks");
      CHECK(length == 0 || (inTable(packed, length) && packed[1] == EDGE_LINK_HEARTBEAT), "a heartbeat is a packet");
      break;
    case 3:
      length = forge(bytes, (uint8_t)(what / 8), receiver->session, near, digests[0], packed);
      deliver(packed, withSamples(packed, length, setSample));
      break;
    default:  // the next samples, some of them twice, or after a gap
      send(near - (what / 64 == 1 ? takeByte(bytes) % 16u : 0) + (what / 64 == 2 ? takeByte(bytes) % 16u : 0),
           1 + what / 8 % 7, what / 64 == 3 ? takeByte(bytes) : 0);
      break;
  }
}

/** A new session, and samples without a fault: an answer for each as soon as the window is full. */
static void streamAnew(uint32_t from) {
  uint8_t packed[EDGE_LINK_MAX_BYTES];
  const toyNetwork_t *toy = &watched[1].toy;
  const uint8_t session = (uint8_t)(receiver->session % 255 + 1);
  deliver(packed, packReset(session, 0xfeedbeef, EDGE_LINK_PAPER, digests[1], packed));
  CHECK(receiver->network == &receiver->networks[1] && receiver->empty,
        "a new session begins, whatever was said before");
  // The network begins on a multiple of its stride, and answers on one.
  const uint32_t count = 1 + from % EDGE_LINK_SAMPLES;
  for (uint32_t i = 0; i < toy->window + 2u * (toy->stride - 1u); i += count) {
    send(from + i, (int)count, 0);
  }
  CHECK(receiver->answers > 0 && receiver->filled >= toy->window, "answers come once the window is full");
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  bytes_t bytes = {data, size};
  linkNetwork_t networks[2];
  for (int i = 0; i < 2; i++) {
    const uint8_t shape = takeByte(&bytes);
    watched[i] = (watched_t){.toy = toyMake((uint16_t)(1 + shape % 64), (uint16_t)(1 + shape / 64))};
    networks[i] = toyAsNetwork(&watched[i].toy, i == 0 ? EDGE_LINK_BEST : EDGE_LINK_PAPER, digests[i]);
    networks[i].context = &watched[i];
    networks[i].reset = watchedReset;
    networks[i].step = watchedStep;
  }
  receiver = rubbish(sizeof *receiver, 0xa5);
  linkReceiverInit(receiver, networks, 2);
  for (int i = 0; i < PACKETS && bytes.left > 0; i++) {
    doOne(&bytes);
  }
  streamAnew(takeWord(&bytes));
  free(receiver);
  return 0;
}
