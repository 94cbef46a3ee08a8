// The two ends of the link over a pipe of bytes with faults; built with sanitizers by test_link.py.
// Each file is a script: its bytes decide what happens to each packet. Checked here, for any script:
// every answer that the sender accepts is what the network says of that sample without any fault; and once
// the faults end, answers come within ten packets where the GAP8 kept its state, else within those that
// a whole window takes and ten more.
#include <stdio.h>
#include <string.h>

#include "feature_window.h"
#include "gap8_core.h"
#include "link_pipe.h"
#include "link_sender.h"
#include "stream_int8.h"

#define MAX_STEPS 1400
#define CLEAN_STEPS 320  // before the faults, so that answers come
#define AFTER_STEPS 120  // after them

typedef struct {
  uint8_t samples[MAX_STEPS][EDGE_LINK_SAMPLE_BYTES];
  int8_t truth[MAX_STEPS][EDGE_LINK_OUTPUTS];
  bool known[MAX_STEPS];
} world_t;

static world_t best, paper, paperStream;
static const gap8Models_t models = GAP8_EXPORTED;
static gap8Core_t gap8;
static linkSender_t sender;
static pipe_t up, down;
static bool swift;

// What the networks say without a link: the kernels alone, from the first sample on.
static void findTruth(void) {
  static int8_t arena[AIRTOUCH_STREAM_ARENA_BYTES] __attribute__((aligned(4)));
  static int8_t network[AIRTOUCH_MODEL_ARENA_BYTES] __attribute__((aligned(4)));
  static float rows[MAX_STEPS][3];
  static int8_t quantised[GAP8_VALUES];
  static float window[GAP8_VALUES];
  static int8_t rings[AIRTOUCH_ROLLING_ARENA_BYTES] __attribute__((aligned(4)));
  static rollingInt8_t rolling;
  streamState_t state;
  streamInt8Reset(&airtouchStream, &state, arena);
  check(rollingInt8Init(&rolling, &airtouchRolling, AIRTOUCH_ROLLING_STRIDE, rings), "the network rolls");
  for (int i = 0; i < MAX_STEPS; i++) {
    for (int c = 0; c < EDGE_LINK_SAMPLE_BYTES; c++) {
      best.samples[i][c] = (uint8_t)(random8() >> (i % 5));
    }
    const int8_t *logits = streamInt8Step(&airtouchStream, &state, (const int8_t *)best.samples[i]);
    best.known[i] = logits != NULL;
    if (logits != NULL) {
      memcpy(best.truth[i], logits, EDGE_LINK_OUTPUTS);
    }
    for (int c = 0; c < 3; c++) {
      rows[i][c] = (float)random8() * (float)(1 + i % 7);
    }
    memcpy(paper.samples[i], rows[i], EDGE_LINK_SAMPLE_BYTES);
    paper.known[i] = i >= AIRTOUCH_MODEL_ROWS - 1;
    if (paper.known[i]) {
      zScoreWindow(rows[i - AIRTOUCH_MODEL_ROWS + 1], AIRTOUCH_MODEL_ROWS, 3, window);
      networkInt8Quantise(&airtouchNetwork, window, GAP8_VALUES, quantised);
      memcpy(paper.truth[i], networkInt8Run(&airtouchNetwork, quantised, network), AIRTOUCH_MODEL_OUTPUTS);
    }
    memcpy(paperStream.samples[i], rows[i], EDGE_LINK_SAMPLE_BYTES);
    fixedScaleApply(&airtouchRollingScale, rows[i], window);
    networkInt8Quantise(&airtouchRolling, window, AIRTOUCH_ROLLING_COLUMNS, quantised);
    logits = rollingInt8Step(&rolling, quantised);
    paperStream.known[i] = logits != NULL;
    if (logits != NULL) {
      memcpy(paperStream.truth[i], logits, AIRTOUCH_ROLLING_OUTPUTS);
    }
  }
}

static void gap8Step(int step, script_t *script) {
  static flight_t packets[QUEUE];
  uint8_t reply[EDGE_LINK_MAX_BYTES];
  const int count = arrived(&up, step, packets);
  for (int i = 0; i < count; i++) {
    // Exactly as much memory as the packet has, so that a byte too far is seen.
    uint8_t *exact = malloc(packets[i].length + 1u);
    memcpy(exact, packets[i].bytes, packets[i].length);
    const uint16_t length = gap8CoreTake(&gap8, exact, packets[i].length, reply);
    free(exact);
    check(length <= EDGE_LINK_MAX_BYTES, "a reply fits a packet");
    if (length > 0) {
      transmit(&down, reply, length, step, script);
    }
  }
  if (step % 50 == 0) {
    const uint16_t length = gap8CoreHeartbeat(&gap8, (uint32_t)step * 10u, reply);
    if (length > 0) {
      transmit(&down, reply, length, step, script);
    }
  }
}

// @return how many answers were accepted
static int takeAnswers(const world_t *world, int step) {
  static flight_t packets[QUEUE];
  linkAnswer_t answers[EDGE_LINK_ANSWERS];
  static uint32_t last;
  static bool any;
  if (step == 0) {
    any = false;
  }
  int accepted = 0;
  const int count = arrived(&down, step, packets);
  for (int i = 0; i < count; i++) {
    uint8_t *exact = malloc(packets[i].length + 1u);
    memcpy(exact, packets[i].bytes, packets[i].length);
    const int found = linkSenderTake(&sender, exact, packets[i].length, answers);
    free(exact);
    for (int k = 0; k < found; k++) {
      const uint32_t at = answers[k].sequence;
      check(at < MAX_STEPS && (int)at <= step, "an answer is to a sample that was sent");
      check(world->known[at], "the network computes at that sample");
      check(memcmp(answers[k].output, world->truth[at], world == &best ? 3 : 2) == 0, "an answer is right");
      check(!any || at > last, "answers come in order, each once");
      last = at;
      any = true;
    }
    accepted += found;
  }
  return accepted;
}

// One step of both ends. @return how many answers were accepted; *packets grows by those sent
static int stepLink(const world_t *world, int step, script_t *script, int *packets, bool *wasReset) {
  uint8_t bytes[EDGE_LINK_MAX_BYTES];
  int accepted = 0;
  linkSenderPush(&sender, world->samples[step]);
  for (int i = 0; i < 2; i++) {
    const uint16_t length = linkSenderPoll(&sender, bytes);
    if (length == 0) {
      break;
    }
    check(length <= EDGE_LINK_MAX_BYTES, "a packet fits");
    const uint8_t fate = script->left > 0 ? next(script) : 0;
    if (fate % 64 == 63) {
      linkSenderSent(&sender, false);
      continue;
    }
    if (fate % 64 == 62) {
      gap8CoreInit(&gap8, &models, NULL);
      *wasReset = true;
    }
    linkSenderSent(&sender, true);
    (*packets)++;
    transmit(&up, bytes, length, step, script);
    if (swift) {  // the answer is there before the step's second packet is made
      gap8Step(step, script);
      accepted += takeAnswers(world, step);
    }
  }
  gap8Step(step, script);
  return accepted + takeAnswers(world, step);
}

static void runScript(const uint8_t *data, size_t length, int *slowest) {
  script_t script = {data, length}, none = {data, 0};
  const uint8_t kind = next(&script);
  const struct {
    const world_t *world;
    const char *sha256;
    uint16_t window, stride;
    uint8_t algorithm;
  } detectors[] =
      {
          {&best, AIRTOUCH_STREAM_SHA256, streamInt8Window(&airtouchStream), (uint16_t)airtouchStream.stride,
           EDGE_LINK_BEST},
          {&paper, AIRTOUCH_MODEL_SHA256, AIRTOUCH_MODEL_ROWS, 1, EDGE_LINK_PAPER},
          {&paperStream, AIRTOUCH_ROLLING_SHA256, AIRTOUCH_ROLLING_ROWS, AIRTOUCH_ROLLING_STRIDE,
           EDGE_LINK_PAPER_STREAM},
      },
    *detector = &detectors[kind % 3];
  swift = kind / 3 % 2;
  const world_t *world = detector->world;
  uint8_t digest[EDGE_LINK_DIGEST_BYTES];
  edgeLinkDigest(detector->sha256, digest);
  const uint16_t window = detector->window;
  up.count = down.count = 0;
  gap8CoreInit(&gap8, &models, NULL);
  linkSenderInit(&sender, detector->algorithm, digest, (uint16_t)(window + detector->stride - 1), 7, 250);
  int packets = 0, step = 0;
  bool wasReset = false;
  for (; step < CLEAN_STEPS; step++) {
    stepLink(world, step, &none, &packets, &wasReset);
  }
  check(sender.state == LINK_UP && !wasReset, "the link comes up");
  while (script.left > 0 && step < MAX_STEPS - AFTER_STEPS) {
    stepLink(world, step++, &script, &packets, &wasReset);
  }
  for (int i = 0; i < up.count; i++) {
    up.packets[i].due = step;  // late packets come now; then the faults are over
  }
  for (int i = 0; i < down.count; i++) {
    down.packets[i].due = step;
  }
  packets = 0;
  int accepted = 0;
  for (int i = 0; i < AFTER_STEPS; i++) {
    accepted += stepLink(world, step++, &none, &packets, &wasReset);
    // The last samples of a long silence may be lost after its end: until the next packet is due.
    const bool anew = wasReset || sender.counters.samplesLost > 0 || sender.counters.resets > 0;
    const int allowed = anew ? 10 + (window + EDGE_LINK_SAMPLES) / EDGE_LINK_SAMPLES : 10;
    check(accepted > 0 || packets < allowed, anew ? "answers come back after a reset" : "answers within ten packets");
    if (accepted == 0 && !anew && packets + 1 > *slowest) {
      *slowest = packets + 1;
    }
  }
  check(sender.state == LINK_UP, "the link is up again");
  check(linkSenderBacklog(&sender) <= EDGE_LINK_SAMPLES, "nothing lags behind");
}

// Packets that look right and say anything: no answer is right here, but nothing may break.
static void forge(void) {
  linkAnswer_t answers[EDGE_LINK_ANSWERS];
  uint8_t bytes[EDGE_LINK_MAX_BYTES], reply[EDGE_LINK_MAX_BYTES], digest[EDGE_LINK_DIGEST_BYTES];
  gap8CoreInit(&gap8, &models, NULL);
  edgeLinkDigest(AIRTOUCH_STREAM_SHA256, digest);
  linkSenderInit(&sender, EDGE_LINK_BEST, digest, 300, 7, 1);
  for (int i = 0; i < 60000; i++) {
    edgeLinkPacket_t packet;
    for (size_t k = 0; k < sizeof packet; k++) {
      ((uint8_t *)&packet)[k] = random8();
    }
    packet.type = (uint8_t)(1 + random8() % 4);
    packet.session = random8() % 2 ? sender.session : random8();
    packet.sequence = random8() % 2 ? sender.samples - random8() : packet.sequence;
    if (packet.type == EDGE_LINK_RESET && random8() % 2) {
      packet.reset.algorithm = EDGE_LINK_BEST;
      memcpy(packet.reset.digest, digest, sizeof digest);
    } else if (packet.type == EDGE_LINK_FEATURES) {
      packet.features.count = (uint8_t)(1 + random8() % EDGE_LINK_SAMPLES);
    } else if (packet.type == EDGE_LINK_RESULT) {
      packet.result.count = (uint8_t)(random8() % (EDGE_LINK_ANSWERS + 1));
      packet.result.expected = random8() % 4 ? sender.samples - random8() : packet.result.expected;
    }
    const uint16_t length = edgeLinkPack(&packet, bytes);
    check(length > 0 && edgeLinkParse(bytes, length, &packet), "what is packed can be read");
    check(gap8CoreTake(&gap8, bytes, length, reply) <= EDGE_LINK_MAX_BYTES, "a reply fits a packet");
    check(linkSenderTake(&sender, bytes, length, answers) <= EDGE_LINK_ANSWERS, "answers fit their room");
    linkSenderPush(&sender, best.samples[i % MAX_STEPS]);
    linkSenderSent(&sender, linkSenderPoll(&sender, bytes) > 0 && random8() % 8);
    check(linkSenderBacklog(&sender) <= LINK_HISTORY, "no more waits than is kept");
  }
}

int main(int argc, char **argv) {
  findTruth();
  if (argc == 2 && strcmp(argv[1], "forge") == 0) {
    forge();
    printf("0 scripts, answers after at most 0 packets\n");
    return 0;
  }
  int slowest = 1;
  for (int i = 1; i < argc; i++) {
    FILE *file = fopen(argv[i], "rb");
    check(file != NULL, argv[i]);
    uint8_t *data = malloc(1 << 16);
    const size_t length = fread(data, 1, 1 << 16, file);
    fclose(file);
    noise = (uint32_t)i + 77u;
    runScript(data, length, &slowest);
    free(data);
  }
  printf("%d scripts, answers after at most %d packets\n", argc - 1, slowest);
  return 0;
}
