// gap8_core.h: everything that the GAP8 app does, with the shipped networks. Raw bytes and packets with a right CRC
// that say anything; samples of any bytes, NaN and infinite features too. Promised: every reply is a packet, and the
// newest answer is what the kernels say of the last window of samples, run without a link.
#include "feature_window.h"
#include "forge.h"
#include "gap8_core.h"
#include "packet_table.h"
#include "stream_int8.h"

// Samples of an input, at most: each costs a whole network, and most inputs need no full window.
#define FEW_SAMPLES 30
#define BEST_SAMPLES 300
#define PAPER_SAMPLES 102
#define STREAM_SAMPLES 300

static gap8Core_t *core;
static const gap8Models_t models = GAP8_EXPORTED;
static uint8_t digests[GAP8_NETWORKS][EDGE_LINK_DIGEST_BYTES];
static uint32_t salt, most;

/** Twelve bytes that follow from the sequence: for `best` int8, for `paper` floats, some of them none. */
static void sampleOf(uint32_t sequence, uint8_t sample[EDGE_LINK_SAMPLE_BYTES]) {
  static const float odd[8] = {NAN, INFINITY, -INFINITY, FLT_MAX, 0.0f, 1e-45f, -1.0f, 1e20f};
  const linkNetwork_t *network = core->receiver.network;
  uint32_t seed = sequence * 2654435761u ^ salt;
  float features[3];
  for (int i = 0; i < 3; i++) {
    noise(&seed);
    features[i] = (seed >> 24) < (salt & 0x7f) ? odd[seed >> 16 & 7] : (float)(seed >> 12) * 1e-3f;
  }
  memcpy(sample, features, sizeof features);
  for (int i = 0; i < EDGE_LINK_SAMPLE_BYTES && (network == NULL || network->algorithm == EDGE_LINK_BEST); i++) {
    noise(&seed);
    sample[i] = (uint8_t)(seed >> 24);
  }
}

static void bestSays(uint32_t sequence, int8_t *output) {
  static _Alignas(4) int8_t arena[AIRTOUCH_STREAM_ARENA_BYTES];
  const uint32_t window = streamInt8Window(&airtouchStream);
  streamState_t state;
  streamInt8Reset(&airtouchStream, &state, arena);
  for (uint32_t i = 0; i < window; i++) {
    uint8_t sample[EDGE_LINK_SAMPLE_BYTES];
    sampleOf(sequence + 1 - window + i, sample);
    state.phase = (int32_t)((sequence + 1 - window + i) % (uint32_t)airtouchStream.stride);
    const int8_t *logits = streamInt8Step(&airtouchStream, &state, (const int8_t *)sample);
    if (logits != NULL) {
      memcpy(output, logits, EDGE_LINK_OUTPUTS);
    }
  }
}

static void paperSays(uint32_t sequence, int8_t *output) {
  static _Alignas(4) int8_t arena[AIRTOUCH_MODEL_ARENA_BYTES], quantised[GAP8_VALUES];
  static float window[GAP8_VALUES];
  for (uint32_t i = 0; i < AIRTOUCH_MODEL_ROWS; i++) {
    uint8_t sample[EDGE_LINK_SAMPLE_BYTES];
    sampleOf(sequence + 1 - AIRTOUCH_MODEL_ROWS + i, sample);
    memcpy(window + i * AIRTOUCH_MODEL_COLUMNS, sample, sizeof sample);
  }
  zScoreWindow(window, AIRTOUCH_MODEL_ROWS, AIRTOUCH_MODEL_COLUMNS, window);
  networkInt8Quantise(&airtouchNetwork, window, GAP8_VALUES, quantised);
  memcpy(output, networkInt8Run(&airtouchNetwork, quantised, arena), AIRTOUCH_MODEL_OUTPUTS);
}

/** false where a feature was not finite: the network began anew there. */
static bool paperStreamSays(uint32_t sequence, int8_t *output) {
  static _Alignas(4) int8_t arena[AIRTOUCH_ROLLING_ARENA_BYTES];
  rollingInt8_t rolling;
  rollingInt8Init(&rolling, &airtouchRolling, AIRTOUCH_ROLLING_STRIDE, arena);
  const uint32_t span =
      (uint32_t)(rolling.receptiveSamples + rolling.stride - 1) / (uint32_t)rolling.stride * (uint32_t)rolling.stride;
  for (uint32_t i = 0; i < span; i++) {
    uint8_t sample[EDGE_LINK_SAMPLE_BYTES];
    float x[AIRTOUCH_ROLLING_COLUMNS];
    int8_t quantised[AIRTOUCH_ROLLING_COLUMNS];
    sampleOf(sequence + 1 - span + i, sample);
    memcpy(x, sample, sizeof x);
    if (!isfinite(x[0]) || !isfinite(x[1]) || !isfinite(x[2])) {
      return false;
    }
    fixedScaleApply(&airtouchRollingScale, x, x);
    networkInt8Quantise(&airtouchRolling, x, AIRTOUCH_ROLLING_COLUMNS, quantised);
    const int8_t *logits = rollingInt8Step(&rolling, quantised);
    if (logits != NULL) {
      memcpy(output, logits, AIRTOUCH_ROLLING_OUTPUTS);
    }
  }
  return true;
}

static void checkNewest(void) {
  const linkReceiver_t *receiver = &core->receiver;
  if (receiver->network == NULL || receiver->answers == 0) {
    return;
  }
  int8_t right[EDGE_LINK_OUTPUTS] = {0};
  const uint32_t sequence = receiver->answer[receiver->answers - 1].sequence;
  if (receiver->network->algorithm == EDGE_LINK_BEST) {
    bestSays(sequence, right);
  } else if (receiver->network->algorithm == EDGE_LINK_PAPER) {
    paperSays(sequence, right);
  } else if (!paperStreamSays(sequence, right)) {
    return;
  }
  CHECK(memcmp(right, receiver->answer[receiver->answers - 1].output, sizeof right) == 0,
        "an answer is what the kernels say of the window that ends there");
}

static void deliver(const uint8_t *packet, uint16_t length) {
  uint8_t *exact = exactCopy(packet, length);
  uint8_t *reply = rubbish(EDGE_LINK_MAX_BYTES, 0x5a);
  const uint32_t refused = core->receiver.packetsRefused, taken = core->receiver.samplesTaken;
  const uint16_t size = gap8CoreTake(core, exact, length, reply);
  CHECK(size == 0 ? core->receiver.packetsRefused == refused + 1 : inTable(reply, size),
        "a packet is refused, or answered by one");
  CHECK(core->receiver.samplesTaken - taken <= EDGE_LINK_SAMPLES, "a packet costs seven runs of a network at most");
  free(reply);
  free(exact);
}

static void doOne(bytes_t *bytes) {
  uint8_t packed[EDGE_LINK_MAX_BYTES + 30] = {0};
  const linkReceiver_t *receiver = &core->receiver;
  const uint8_t what = takeByte(bytes);
  const int which = receiver->network == NULL ? 0 : (int)(receiver->network - core->networks);
  uint16_t length;
  switch (what % 8) {
    case 0:
      length = (uint16_t)takeBelow(bytes, sizeof packed);
      takeInto(bytes, packed, length);
      deliver(packed, withSamples(packed, length, sampleOf));
      break;
    case 1:
      length = gap8CoreHeartbeat(core, takeWord(bytes), packed);
      CHECK(length == 0 || inTable(packed, length), "a heartbeat is a packet");
      break;
    case 2:
      length = forge(bytes, what / 8, receiver->session, receiver->expected, digests[which], packed);
      deliver(packed, withSamples(packed, length, sampleOf));
      break;
    case 3:
      length =
          packReset(takeByte(bytes), what, core->networks[what / 8 % 3].algorithm, digests[what / 8 % 4 % 3], packed);
      deliver(packed, length);
      break;
    default:  // a run of samples as the sender would send them
      for (int i = what / 8; i >= 0 && core->receiver.samplesTaken < most; i--) {
        deliver(packed, packSamples(receiver->session, receiver->expected, 7,
                                    receiver->empty ? 0 : takeByte(bytes) / 128, sampleOf, packed));
      }
      break;
  }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  bytes_t bytes = {data, size};
  uint8_t packed[EDGE_LINK_MAX_BYTES];
  salt = takeByte(&bytes);
  core = rubbish(sizeof *core, 0xa5);
  CHECK(gap8CoreInit(core, &models, NULL) == GAP8_NETWORKS, "the shipped networks fit");
  for (int i = 0; i < GAP8_NETWORKS; i++) {
    memcpy(digests[i], core->networks[i].digest, EDGE_LINK_DIGEST_BYTES);
  }
  const int which = (int)(salt / 16 % GAP8_NETWORKS);
  deliver(packed, packReset(1, 1, core->networks[which].algorithm, digests[which], packed));
  static const uint32_t whole[GAP8_NETWORKS] = {BEST_SAMPLES, PAPER_SAMPLES, STREAM_SAMPLES};
  most = oneIn(12, data, size) ? whole[which] : FEW_SAMPLES;
  while (bytes.left > 0 && core->receiver.samplesTaken < most) {
    doOne(&bytes);
  }
  checkNewest();
  free(core);
  return 0;
}
