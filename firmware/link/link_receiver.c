#include "link_receiver.h"

#include <stddef.h>
#include <string.h>

void linkReceiverInit(linkReceiver_t *receiver, const linkNetwork_t *networks, uint8_t count) {
  memset(receiver, 0, sizeof *receiver);
  receiver->networks = networks;
  receiver->networkCount = count;
}

static uint8_t flagsOf(const linkReceiver_t *receiver) {
  if (receiver->network == NULL) {
    return receiver->mismatch ? EDGE_LINK_MISMATCH : EDGE_LINK_UNKNOWN;
  }
  if (receiver->empty) {
    return EDGE_LINK_EMPTY | EDGE_LINK_FILLING;
  }
  return receiver->filled < receiver->network->window ? EDGE_LINK_FILLING : 0;
}

/** The network forgets; `expected` is the first sample of what it will see. */
static void resetNetwork(linkReceiver_t *receiver, uint32_t expected) {
  receiver->network->reset(receiver->network->context);
  receiver->filled = 0;
  receiver->answers = 0;
  receiver->expected = expected;
}

static void beginSession(linkReceiver_t *receiver, const edgeLinkPacket_t *packet) {
  const edgeLinkReset_t *reset = &packet->reset;
  const bool known = packet->session == receiver->session && reset->nonce == receiver->nonce;
  const bool late = packet->session == receiver->oldSession && reset->nonce == receiver->oldNonce;
  if (packet->session == 0 || known || late) {
    return;
  }
  receiver->oldSession = receiver->session;
  receiver->oldNonce = receiver->nonce;
  receiver->session = packet->session;
  receiver->nonce = reset->nonce;
  receiver->network = NULL;
  receiver->mismatch = true;
  for (int i = 0; i < receiver->networkCount; i++) {
    const linkNetwork_t *network = &receiver->networks[i];
    if (network->algorithm == reset->algorithm && memcmp(network->digest, reset->digest, EDGE_LINK_DIGEST_BYTES) == 0) {
      receiver->network = network;
      receiver->mismatch = false;
      receiver->empty = true;
      resetNetwork(receiver, 0);
    }
  }
}

static void keepAnswer(linkReceiver_t *receiver, const int8_t output[EDGE_LINK_OUTPUTS]) {
  if (receiver->answers == EDGE_LINK_ANSWERS) {
    memmove(&receiver->answer[0], &receiver->answer[1], (EDGE_LINK_ANSWERS - 1) * sizeof receiver->answer[0]);
    receiver->answers--;
  }
  receiver->answer[receiver->answers].sequence = receiver->expected;
  memcpy(receiver->answer[receiver->answers].output, output, EDGE_LINK_OUTPUTS);
  receiver->answers++;
}

/** Gives the expected sample to the network. */
static void useSample(linkReceiver_t *receiver, const uint8_t sample[EDGE_LINK_SAMPLE_BYTES]) {
  const linkNetwork_t *network = receiver->network;
  // The network computes on the same samples after every reset: on multiples of its stride.
  if (receiver->filled > 0 || receiver->expected % network->stride == 0) {
    int8_t output[EDGE_LINK_OUTPUTS] = {0};
    const bool computed = network->step(network->context, sample, output);
    receiver->filled += receiver->filled < UINT32_MAX ? 1 : 0;
    if (computed && receiver->filled >= network->window) {
      keepAnswer(receiver, output);
    }
  }
  receiver->samplesTaken++;
  receiver->expected++;
}

/** @return EDGE_LINK_GAP where samples are missing, else 0 */
static uint8_t useSamples(linkReceiver_t *receiver, uint32_t first, const edgeLinkFeatures_t *features) {
  const uint32_t oldest = first - features->back;
  if (receiver->empty) {
    receiver->empty = false;
    resetNetwork(receiver, oldest);
  } else if (edgeLinkAfter(oldest, receiver->expected) > 0) {
    receiver->samplesLost += oldest - receiver->expected;
    resetNetwork(receiver, oldest);
  }
  if (edgeLinkAfter(first, receiver->expected) > 0) {
    return EDGE_LINK_GAP;
  }
  for (int i = 0; i < features->count; i++) {
    if (first + (uint32_t)i == receiver->expected) {
      useSample(receiver, features->sample[i]);
    } else {
      receiver->samplesRepeated++;
    }
  }
  return 0;
}

static void fillResult(const linkReceiver_t *receiver, edgeLinkResult_t *result, uint8_t flags) {
  result->expected = receiver->expected;
  result->flags = (uint8_t)(flagsOf(receiver) | flags);
  result->count = 0;
  for (int i = 0; i < receiver->answers && receiver->network != NULL; i++) {
    const uint32_t back = receiver->expected - receiver->answer[i].sequence;
    if (back < 1 || back > UINT8_MAX) {
      continue;
    }
    edgeLinkAnswer_t *answer = &result->answer[result->count++];
    answer->back = (uint8_t)back;
    memcpy(answer->output, receiver->answer[i].output, EDGE_LINK_OUTPUTS);
  }
}

uint16_t linkReceiverTake(linkReceiver_t *receiver, const uint8_t *bytes, uint16_t length, uint8_t *reply) {
  edgeLinkPacket_t packet;
  if (!edgeLinkParse(bytes, length, &packet)) {
    receiver->packetsRefused++;
    return 0;
  }
  edgeLinkPacket_t answer = {.type = EDGE_LINK_RESULT, .session = packet.session, .sequence = packet.sequence};
  uint8_t flags = 0;
  if (packet.type == EDGE_LINK_RESET) {
    beginSession(receiver, &packet);
  } else if (packet.type != EDGE_LINK_FEATURES) {
    receiver->packetsRefused++;
    return 0;
  }
  receiver->beats = LINK_BEATS;
  if (packet.session == 0 || packet.session != receiver->session) {
    answer.result.flags = EDGE_LINK_UNKNOWN;
    return edgeLinkPack(&answer, reply);
  }
  if (packet.type == EDGE_LINK_FEATURES && receiver->network != NULL) {
    flags = useSamples(receiver, packet.sequence, &packet.features);
  }
  fillResult(receiver, &answer.result, flags);
  return edgeLinkPack(&answer, reply);
}

uint16_t linkReceiverHeartbeat(linkReceiver_t *receiver, uint32_t uptimeMs, uint8_t *bytes) {
  if (receiver->beats == 0) {
    return 0;
  }
  receiver->beats--;
  edgeLinkPacket_t packet = {
      .type = EDGE_LINK_HEARTBEAT, .session = receiver->session, .sequence = receiver->heartbeats++};
  edgeLinkHeartbeat_t *beat = &packet.heartbeat;
  beat->uptimeMs = uptimeMs;
  beat->expected = receiver->expected;
  beat->samplesTaken = receiver->samplesTaken;
  beat->samplesLost = receiver->samplesLost;
  beat->packetsRefused = receiver->packetsRefused;
  beat->flags = flagsOf(receiver);
  if (receiver->network != NULL) {
    beat->algorithm = receiver->network->algorithm;
    memcpy(beat->digest, receiver->network->digest, EDGE_LINK_DIGEST_BYTES);
  }
  return edgeLinkPack(&packet, bytes);
}
