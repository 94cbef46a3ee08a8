#include "link_sender.h"

#include <string.h>

#define HOLD_OFF_STEPS 4  // after a rewind, in which requests for another are old news; no source: round number

/** The stream begins with as much of the past as the network needs. */
static void rebase(linkSender_t *sender) {
  const uint32_t held = sender->samples < sender->refill ? sender->samples : sender->refill;
  sender->base = sender->samples - held;
  sender->next = sender->base;
}

static void restart(linkSender_t *sender, uint8_t session) {
  rebase(sender);
  sender->session = session;
  sender->state = LINK_STARTING;
  sender->outstanding = 0;
  sender->holdOff = 0;
}

static uint8_t nextSession(const linkSender_t *sender) {
  return (uint8_t)(sender->session == 255 ? 1 : sender->session + 1);
}

/** The stream begins again in a session of its own. */
static void beginNextSession(linkSender_t *sender) { restart(sender, nextSession(sender)); }

/** The next try is due. */
static void makeRetryDue(linkSender_t *sender) { sender->sinceRetry = UINT16_MAX; }

/** A try is made: the next one comes after the same interval, or twice that where the silence has cost samples. */
static void noteRetry(linkSender_t *sender) {
  sender->trying = true;
  sender->intervalBefore = sender->retryInterval;
  sender->sinceRetry = 0;
  if (sender->silent >= LINK_HISTORY) {
    sender->retryInterval =
        (uint16_t)(2 * sender->retryInterval < LINK_RETRY_MOST ? 2 * sender->retryInterval : LINK_RETRY_MOST);
  }
}

void linkSenderInit(linkSender_t *sender, uint8_t algorithm, const uint8_t digest[EDGE_LINK_DIGEST_BYTES],
                    uint16_t refill, uint32_t nonce, uint8_t session) {
  memset(sender, 0, sizeof *sender);
  memcpy(sender->digest, digest, EDGE_LINK_DIGEST_BYTES);
  sender->algorithm = algorithm;
  sender->refill = refill < LINK_HISTORY ? refill : LINK_HISTORY;
  sender->nonce = nonce;
  sender->retryInterval = LINK_RETRY_STEPS;
  makeRetryDue(sender);
  restart(sender, session == 0 ? 1 : session);
}

static void countUp(uint16_t *steps) { *steps = (uint16_t)(*steps + (*steps < UINT16_MAX ? 1 : 0)); }

/** Moves the base past what the history no longer holds. */
static void forget(linkSender_t *sender) {
  if (sender->samples - sender->base > LINK_HISTORY) {
    sender->counters.samplesLost += sender->samples - sender->base - LINK_HISTORY;
    sender->base = sender->samples - LINK_HISTORY;
    if (edgeLinkAfter(sender->base, sender->next) > 0) {
      sender->next = sender->base;
    }
  }
}

void linkSenderPush(linkSender_t *sender, const uint8_t sample[EDGE_LINK_SAMPLE_BYTES]) {
  memcpy(sender->history[sender->samples % LINK_HISTORY], sample, EDGE_LINK_SAMPLE_BYTES);
  sender->samples++;
  if (sender->state == LINK_STARTING || sender->state == LINK_REFUSED) {
    rebase(sender);
  }
  forget(sender);
  countUp(&sender->silent);
  countUp(&sender->sinceRetry);
  sender->holdOff = (uint8_t)(sender->holdOff - (sender->holdOff > 0 ? 1 : 0));
  if (sender->silent >= LINK_DOWN_STEPS && (sender->state == LINK_UP || sender->state == LINK_FILLING)) {
    sender->state = LINK_DOWN;
  }
}

static void packReset(const linkSender_t *sender, edgeLinkPacket_t *packet) {
  packet->type = EDGE_LINK_RESET;
  packet->sequence = sender->samples;
  packet->reset.nonce = sender->nonce;
  packet->reset.algorithm = sender->algorithm;
  memcpy(packet->reset.digest, sender->digest, EDGE_LINK_DIGEST_BYTES);
}

/** The samples from `next` on; those before it that are unconfirmed fill the packet up. */
static void packFeatures(linkSender_t *sender, edgeLinkPacket_t *packet) {
  uint32_t from = sender->next;
  const uint32_t unconfirmed = sender->samples - sender->base;
  if (sender->samples - from < EDGE_LINK_SAMPLES) {
    from = sender->samples - (unconfirmed < EDGE_LINK_SAMPLES ? unconfirmed : EDGE_LINK_SAMPLES);
  }
  const uint32_t left = sender->samples - from;
  packet->type = EDGE_LINK_FEATURES;
  packet->sequence = from;
  packet->features.back = (uint16_t)(from - sender->base);
  packet->features.count = (uint8_t)(left < EDGE_LINK_SAMPLES ? left : EDGE_LINK_SAMPLES);
  for (uint32_t i = 0; i < packet->features.count; i++) {
    memcpy(packet->features.sample[i], sender->history[(from + i) % LINK_HISTORY], EDGE_LINK_SAMPLE_BYTES);
  }
  sender->sending = true;
  sender->sendingFrom = sender->next;
  sender->next = from + packet->features.count;
}

static bool isSilent(const linkSender_t *sender) { return sender->silent >= LINK_RETRY_STEPS; }

/** Whether no answer has come for so long that everything unconfirmed is sent again. */
static bool retryDue(const linkSender_t *sender) {
  return isSilent(sender) && sender->sinceRetry >= sender->retryInterval;
}

/** Everything unconfirmed is sent again. */
static void rewindToBase(linkSender_t *sender) { sender->next = sender->base; }

static void retry(linkSender_t *sender) {
  sender->counters.timeouts++;
  rewindToBase(sender);
  sender->outstanding = 0;
  noteRetry(sender);
}

uint16_t linkSenderPoll(linkSender_t *sender, uint8_t *bytes) {
  edgeLinkPacket_t packet = {.session = sender->session};
  sender->sending = false;
  sender->trying = false;
  const bool refused = sender->state == LINK_REFUSED;
  if (refused || sender->state == LINK_STARTING) {
    if (sender->sinceRetry < sender->retryInterval || (refused && sender->sinceRetry < LINK_REFUSED_STEPS)) {
      return 0;
    }
    noteRetry(sender);
    if (refused) {  // as another session: a RESET of the one that the GAP8 refused changes nothing there
      sender->session = nextSession(sender);
      packet.session = sender->session;
    }
    packReset(sender, &packet);
  } else {
    if ((sender->next == sender->samples && !isSilent(sender)) || sender->base == sender->samples) {
      return 0;
    }
    if (retryDue(sender)) {
      retry(sender);
    } else if (isSilent(sender) || sender->outstanding >= LINK_WINDOW) {
      return 0;
    }
    packFeatures(sender, &packet);
  }
  return edgeLinkPack(&packet, bytes);
}

void linkSenderSent(linkSender_t *sender, bool taken) {
  if (taken) {
    sender->counters.sent++;
    sender->outstanding = (uint8_t)(sender->outstanding + (sender->sending && sender->outstanding < 255 ? 1 : 0));
    return;
  }
  sender->counters.packetsDropped++;
  if (sender->sending) {
    sender->next = sender->sendingFrom;
  }
  if (sender->trying) {  // it was no try: the next packet is one
    sender->counters.timeouts -= sender->sending ? 1 : 0;
    sender->retryInterval = sender->intervalBefore;
    makeRetryDue(sender);
  }
}

bool linkSenderAccept(linkSender_t *sender, uint32_t sequence) {
  if (sender->answered && edgeLinkAfter(sequence, sender->lastAnswer) <= 0) {
    return false;
  }
  sender->answered = true;
  sender->lastAnswer = sequence;
  return true;
}

static int newAnswers(linkSender_t *sender, const edgeLinkResult_t *result, linkAnswer_t *answers) {
  int fresh = 0;
  for (int i = 0; i < result->count; i++) {
    const edgeLinkAnswer_t *answer = &result->answer[i];
    const uint32_t sequence = result->expected - answer->back;
    const bool recent = answer->back > 0 && sender->samples - sequence <= LINK_HISTORY;
    if (!recent || !linkSenderAccept(sender, sequence)) {
      continue;
    }
    answers[fresh].sequence = sequence;
    memcpy(answers[fresh].output, answer->output, EDGE_LINK_OUTPUTS);
    fresh++;
  }
  return fresh;
}

/** Confirms what the receiver has, and goes back where it lacks something. */
static void confirm(linkSender_t *sender, const edgeLinkResult_t *result) {
  if (edgeLinkAfter(result->expected, sender->base) > 0) {
    sender->base = result->expected;
    if (edgeLinkAfter(sender->base, sender->next) > 0) {
      sender->next = sender->base;
    }
  }
  if ((result->flags & EDGE_LINK_GAP) && sender->holdOff == 0) {
    sender->counters.rewinds++;
    rewindToBase(sender);
    sender->holdOff = HOLD_OFF_STEPS;
  }
}

static int takeResult(linkSender_t *sender, const edgeLinkResult_t *result, linkAnswer_t *answers) {
  sender->outstanding = 0;
  if (result->flags & EDGE_LINK_MISMATCH) {
    sender->state = LINK_REFUSED;
    return 0;
  }
  if (result->flags & EDGE_LINK_UNKNOWN) {
    sender->counters.resets += sender->state == LINK_STARTING ? 0 : 1;
    beginNextSession(sender);
    return 0;
  }
  const bool empty = (result->flags & EDGE_LINK_EMPTY) != 0;
  if (!empty && edgeLinkAfter(result->expected, sender->samples) > 0) {
    beginNextSession(sender);  // it confirms what was never sent: not our stream
    return 0;
  }
  sender->state = result->flags & (EDGE_LINK_FILLING | EDGE_LINK_EMPTY) ? LINK_FILLING : LINK_UP;
  if (empty) {
    return 0;
  }
  confirm(sender, result);
  return newAnswers(sender, result, answers);
}

/** The GAP8 is there: it is asked at once. Another session than ours says that it was reset. */
static void takeHeartbeat(linkSender_t *sender, uint8_t session) {
  const bool ours = session == sender->session;
  if (!ours && sender->state != LINK_STARTING && sender->state != LINK_REFUSED) {
    sender->counters.resets++;
    beginNextSession(sender);
  }
  if (!ours || sender->state != LINK_REFUSED) {
    makeRetryDue(sender);
  }
}

int linkSenderTake(linkSender_t *sender, const uint8_t *bytes, uint16_t length, linkAnswer_t *answers) {
  edgeLinkPacket_t packet;
  if (!edgeLinkParse(bytes, length, &packet)) {
    sender->counters.packetsRefused++;
    return 0;
  }
  const bool result = packet.type == EDGE_LINK_RESULT;
  if (!result && packet.type != EDGE_LINK_HEARTBEAT) {
    sender->counters.packetsRefused++;
    return 0;
  }
  sender->counters.received++;
  if (!result) {
    sender->counters.uptimeMs = packet.heartbeat.uptimeMs;
    takeHeartbeat(sender, packet.session);
    return 0;
  }
  if (packet.session != sender->session) {
    return 0;  // an answer to an earlier session
  }
  sender->silent = 0;
  sender->retryInterval = LINK_RETRY_STEPS;
  return takeResult(sender, &packet.result, answers);
}

uint32_t linkSenderBacklog(const linkSender_t *sender) { return sender->samples - sender->base; }
