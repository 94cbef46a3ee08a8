// link_sender.h and link_receiver.h over a pipe that loses, doubles, delays, cuts and changes packets, while the GAP8
// may be reset; in hostile inputs another program forges packets to both ends as well. Promised by host/docs/link.md:
// no wrong answer, and answers again in a known number of packets once the faults end.
#include "forge.h"
#include "link_sender.h"
#include "packet_table.h"
#include "toy_network.h"

#define STEPS 1500  // of an input, at most
#define STORM 600   // of them with faults
#define PIPE 24
// After forged packets, whatever they said, the longest wait for the next try and a few more.
#define HOSTILE_STEPS (LINK_RETRY_MOST + LINK_REFUSED_STEPS + 4 * LINK_RETRY_STEPS)

typedef struct {
  uint8_t bytes[EDGE_LINK_MAX_BYTES + 16];
  uint16_t length;
  int due;  // step at which it arrives
} transit_t;

typedef struct {
  transit_t packets[PIPE];
  int count;
} pipe_t;

static const uint8_t digest[EDGE_LINK_DIGEST_BYTES] = {1, 2, 3, 4, 5, 6, 7, 8};
static uint8_t samples[STEPS][EDGE_LINK_SAMPLE_BYTES];
static uint32_t sums[STEPS + 1];
static linkSender_t sender;
static linkReceiver_t receiver;
static toyNetwork_t toy;
static linkNetwork_t network;
static pipe_t up, down;
static bool hostile, reset, late, anyAnswer;
static int step, packets;
static uint32_t lastAnswer;

static void wakeReceiver(void) {
  toyReset(&toy);
  linkReceiverInit(&receiver, &network, 1);
}

static void push(pipe_t *pipe, const uint8_t *bytes, uint16_t length, int due) {
  if (pipe->count < PIPE) {
    transit_t *packet = &pipe->packets[pipe->count++];
    memcpy(packet->bytes, bytes, length);
    packet->length = length;
    packet->due = due;
  }
}

/** A packet goes onto the pipe with the fault that the input orders; none where no input is left. */
static void transmit(pipe_t *pipe, const uint8_t *packet, uint16_t length, bytes_t *bytes) {
  uint8_t raw[EDGE_LINK_MAX_BYTES + 16] = {0};
  const uint8_t fault = bytes->left > 0 ? takeByte(bytes) : 0;
  memcpy(raw, packet, length);
  switch (fault % 16) {
    case 8:
    case 9: return;
    case 10:
      push(pipe, raw, length, step);
      push(pipe, raw, length, step + takeByte(bytes) % 64);
      return;
    case 11: push(pipe, raw, (uint16_t)(takeByte(bytes) % length), step); return;
    case 12:
      raw[takeByte(bytes) % length] ^= (uint8_t)(1 + takeByte(bytes) % 255);
      push(pipe, raw, length, step);
      return;
    case 13:
    case 14: push(pipe, raw, length, step + takeByte(bytes) % 64); return;
    case 15: push(pipe, raw, (uint16_t)(length + 1 + takeByte(bytes) % 15), step); return;
    default: push(pipe, raw, length, step); return;
  }
}

/** Takes the next packet that is due off the pipe, as exactly as much memory as it has; NULL for none. */
static uint8_t *arrived(pipe_t *pipe, uint16_t *length) {
  for (int i = 0; i < pipe->count; i++) {
    if (pipe->packets[i].due <= step) {
      uint8_t *exact = exactCopy(pipe->packets[i].bytes, pipe->packets[i].length);
      *length = pipe->packets[i].length;
      pipe->count--;
      memmove(&pipe->packets[i], &pipe->packets[i + 1], (size_t)(pipe->count - i) * sizeof pipe->packets[0]);
      return exact;
    }
  }
  return NULL;
}

static void receive(bytes_t *bytes) {
  uint8_t reply[EDGE_LINK_MAX_BYTES];
  uint16_t length;
  for (uint8_t *packet = arrived(&up, &length); packet != NULL; packet = arrived(&up, &length)) {
    const uint32_t before = toy.steps;
    const uint16_t size = linkReceiverTake(&receiver, packet, length, reply);
    CHECK(toy.steps - before <= EDGE_LINK_SAMPLES, "a packet costs seven steps of the network at most");
    free(packet);
    if (size > 0) {
      CHECK(inTable(reply, size), "a reply is a packet");
      transmit(&down, reply, size, bytes);
    }
  }
  if (step % 50 == 0) {
    const uint16_t size = linkReceiverHeartbeat(&receiver, (uint32_t)step * 10u, reply);
    if (size > 0) {
      transmit(&down, reply, size, bytes);
    }
  }
}

/** Whether an answer is what the network says of that sample, and newer than the one before. */
static bool isRight(const linkAnswer_t *answer) {
  int8_t right[EDGE_LINK_OUTPUTS];
  return (!anyAnswer || edgeLinkAfter(answer->sequence, lastAnswer) > 0) && answer->sequence < (uint32_t)step &&
         toyTruth(&toy, sums, answer->sequence, right) && memcmp(right, answer->output, sizeof right) == 0;
}

/** @return how many answers were accepted; -1 where one of them was wrong */
static int takeAnswers(void) {
  linkAnswer_t answers[EDGE_LINK_ANSWERS];
  uint16_t length;
  int accepted = 0;
  bool wrong = false;
  for (uint8_t *packet = arrived(&down, &length); packet != NULL; packet = arrived(&down, &length)) {
    const int count = linkSenderTake(&sender, packet, length, answers);
    free(packet);
    CHECK(count >= 0 && count <= EDGE_LINK_ANSWERS, "answers fit their room");
    for (int i = 0; i < count; i++) {
      wrong = wrong || !isRight(&answers[i]);
      anyAnswer = true;
      lastAnswer = answers[i].sequence;
    }
    accepted += count;
  }
  CHECK(!wrong || hostile, "an answer is what the network says of that sample, and each comes once, in order");
  return wrong ? -1 : accepted;
}

static void checkPacket(const uint8_t *bytes, uint16_t length) {
  edgeLinkPacket_t packet;
  uint8_t *exact = exactCopy(bytes, length);
  CHECK(inTable(exact, length) && edgeLinkParse(exact, length, &packet), "what the sender says is a packet");
  CHECK(packet.type == EDGE_LINK_RESET || packet.type == EDGE_LINK_FEATURES, "the sender resets, or sends samples");
  for (uint32_t i = 0; packet.type == EDGE_LINK_FEATURES && i < packet.features.count; i++) {
    const uint32_t at = packet.sequence + i;
    CHECK(at < (uint32_t)step && memcmp(packet.features.sample[i], samples[at], EDGE_LINK_SAMPLE_BYTES) == 0,
          "samples are sent as they were taken");
  }
  free(exact);
}

static void forgeOne(bytes_t *bytes, uint8_t kind) {
  uint8_t packed[EDGE_LINK_MAX_BYTES];
  const uint16_t length = forge(bytes, kind, sender.session, sender.samples, digest, packed);
  push(kind & 16 ? &up : &down, packed, length, step);
}

/** One step of both ends. @return as takeAnswers() */
static int stepLink(bytes_t *bytes) {
  uint8_t packed[EDGE_LINK_MAX_BYTES];
  const uint8_t event = bytes->left > 0 ? takeByte(bytes) : 0;
  if (event % 64 == 63) {
    wakeReceiver();
    reset = true;
    late = late || up.count > 0;
  } else if (hostile && event % 4 == 3) {
    forgeOne(bytes, (uint8_t)(event / 4));
  }
  linkSenderPush(&sender, samples[step]);
  step++;
  for (int i = 0; i < 2; i++) {
    const uint16_t length = linkSenderPoll(&sender, packed);
    if (length == 0) {
      break;
    }
    checkPacket(packed, length);
    const bool taken = event % 64 != 62;
    linkSenderSent(&sender, taken);
    if (taken) {
      packets++;
      transmit(&up, packed, length, bytes);
    }
  }
  receive(bytes);
  const int accepted = takeAnswers();
  CHECK(linkSenderBacklog(&sender) <= LINK_HISTORY, "no more samples wait than are kept");
  CHECK(sender.state <= LINK_REFUSED, "a known state");
  return accepted;
}

static void arriveNow(pipe_t *pipe) {
  for (int i = 0; i < pipe->count; i++) {
    pipe->packets[i].due = step;
  }
}

/** After faults of the pipe: an answer within the packets that host/docs/link.md allows. */
static void answerAgain(void) {
  bytes_t none = {NULL, 0};
  const bool anew =
      reset || sender.counters.samplesLost > 0 || sender.counters.resets > 0 || receiver.filled < toy.window;
  const int window = (toy.window + toy.stride + EDGE_LINK_SAMPLES) / EDGE_LINK_SAMPLES;
  const int young = step < toy.window + toy.stride ? toy.window + toy.stride : 0;  // no window of samples yet
  // Where a packet from before a reset comes after it, the STM32 cannot know, and a window of new samples is needed.
  const int allowed = 10 + (late ? toy.window + toy.stride : (anew ? window : 0)) + young;
  packets = 0;
  for (int accepted = 0; accepted == 0;) {
    accepted = stepLink(&none);
    CHECK(accepted > 0 || packets <= allowed, "answers come again in the packets that are promised");
  }
}

/** In the end every answer comes, right and in time, whatever was said before. */
static void settle(void) {
  bytes_t none = {NULL, 0};
  const int patience = step + LINK_HISTORY / EDGE_LINK_SAMPLES + (hostile ? HOSTILE_STEPS + 2 * toy.window : 0);
  for (int good = 0; good < 8 * toy.stride;) {
    const int accepted = stepLink(&none);
    const bool due = (step - 1) % toy.stride == 0;
    const bool right = accepted == due && sender.state == LINK_UP && linkSenderBacklog(&sender) <= EDGE_LINK_SAMPLES;
    good = right ? good + 1 : 0;
    CHECK(step < patience + 8 * toy.stride, "the link is up, and every answer comes, whatever was said before");
  }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  bytes_t bytes = {data, size}, none = {NULL, 0};
  const uint8_t mode = takeByte(&bytes);
  const uint8_t shape = takeByte(&bytes);
  uint32_t seed = shape;
  hostile = mode & 1;
  toy = toyMake((uint16_t)(mode & 2 || shape < 192 ? 3 + shape % 32 : 250 + shape % 32), (uint16_t)(1 + mode / 4 % 3));
  network = toyAsNetwork(&toy, EDGE_LINK_BEST, digest);
  up.count = down.count = 0;
  reset = late = anyAnswer = false;
  step = packets = 0;
  for (int i = 0; i < STEPS; i++) {
    seed = seed * 1664525u + 1013904223u;
    memset(samples[i], 0, sizeof samples[i]);
    memcpy(samples[i], &seed, sizeof seed);
    sums[i + 1] = sums[i] * TOY_BASE + toyHash(samples[i]);
  }
  wakeReceiver();
  linkSenderInit(&sender, EDGE_LINK_BEST, digest, (uint16_t)(toy.window + toy.stride - 1), 7,
                 (uint8_t)(250 + mode / 16));
  if (mode & 128) {  // the faults meet a link that is up
    for (int i = 0; i < toy.window + 20; i++) {
      stepLink(&none);
    }
    CHECK(sender.state == LINK_UP && !reset, "the link comes up");
  }
  while (bytes.left > 0 && step < STORM) {
    stepLink(&bytes);
  }
  arriveNow(&up);
  arriveNow(&down);
  if (!hostile) {
    answerAgain();
  }
  settle();
  return 0;
}
