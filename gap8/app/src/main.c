// The app on the GAP8: PMSIS with FreeRTOS, CPX from and to the STM32, networks on the cluster. All that it does with
// a packet is in gap8_core.h; this gives it the cluster, a clock and the wire.
//
// It never stops: without a cluster it goes on to take packets off the wire, which others use as well, and tells the
// STM32 that it has no network, so that the STM32 computes by itself. Tasks, semaphore and buffers are static.
// It speaks when spoken to: not a byte before the STM32's first packet, since each one has its risk
// (host/docs/flash.md). What there is to say until then is noted.
#include <stdbool.h>
#include <string.h>

#include "bsp/bsp.h"
#include "pmsis.h"

#include "cpx.h"
#include "gap8_core.h"
#include "l1_models.h"

#define CORES 8
#define FC_HZ 50000000
#define CLUSTER_HZ 175000000  // the most at 1.2 V, which GAP8 starts with
#define SAFE_HZ 50000000      // what the cluster starts with
#define HEARTBEAT_MS 500
#define STACK_WORDS 512  // of the heartbeat's task: chosen, not measured
// Bytes. Chosen: the deepest detector, `paper`, takes 920 on an emulated core (tests/gap8/app/test_gap8_app.py).
#define FIRST_CORE_STACK 2048
#define OTHER_CORE_STACK 2048  // as the first core's, which runs all that the others run

/** What the cluster is asked to do: a packet, and room for the reply. In L2, which both sides see. */
typedef struct {
  uint16_t length;
  uint16_t replyLength;
  uint8_t bytes[EDGE_LINK_MAX_BYTES];
  uint8_t reply[EDGE_LINK_MAX_BYTES];
} request_t;

/** What can go wrong, and the STM32's console is told once. */
typedef enum { NOTE_CONTROLLER_CLOCK, NOTE_CLUSTER_CLOCK, NOTE_CLUSTER_CLOSED, NOTE_CLUSTER_TASK, NOTES } note_t;

static PI_CL_L1 gap8Core_t core;
static PI_CL_L1 uint64_t stacks[(FIRST_CORE_STACK + (CORES - 1) * OTHER_CORE_STACK) / 8];
static linkReceiver_t refusing;  // in place of the core where there is no cluster: it has no network
static bool haveCluster;
static unsigned clusterMHz;
static int32_t networks;
static bool noted[NOTES];
static struct pi_device cluster;
static struct pi_cluster_task clusterTask;
static request_t request;
static CPXPacket_t received;
static CPXPacket_t sent;
static StaticSemaphore_t turnMemory;
static SemaphoreHandle_t turn;  // one task at a time uses the core and sends: CPX packs into one buffer
static StackType_t heartbeatStack[STACK_WORDS];
static StaticTask_t heartbeatMemory;

static void forkTeam(void (*work)(void *), void *argument) { pi_cl_team_fork(CORES, work, argument); }

static int32_t coreNumber(void) { return (int32_t)pi_core_id(); }

static void teamBarrier(void *unused) {
  (void)unused;
  pi_cl_team_barrier(0);
}

static PI_CL_L1 gap8Team_t team = {forkTeam, coreNumber, teamBarrier, CORES};

static void initOnCluster(void *unused) {
  (void)unused;
  const gap8Models_t models = {.best = &gap8L1Stream,
                               .paper = &gap8L1Network,
                               .paperStream = &gap8L1Rolling,
                               .paperStreamScale = &gap8L1RollingScale};
  networks = gap8CoreInit(&core, &models, &team);
}

static void takeOnCluster(void *unused) {
  (void)unused;
  request.replyLength = gap8CoreTake(&core, request.bytes, request.length, request.reply);
}

/** Runs an entry on the cluster's first core and waits for it. A cluster that takes no task is given up. */
static void onCluster(void (*entry)(void *)) {
  pi_cluster_task(&clusterTask, entry, NULL);
  clusterTask.stacks = stacks;
  clusterTask.stack_size = FIRST_CORE_STACK;
  clusterTask.slave_stack_size = OTHER_CORE_STACK;
  if (pi_cluster_send_task_to_cl(&cluster, &clusterTask) != 0) {
    haveCluster = false;
    noted[NOTE_CLUSTER_TASK] = true;
  }
}

static void send(const uint8_t *bytes, uint16_t length) {
  if (length > 0) {
    cpxInitRoute(CPX_T_GAP8, CPX_T_STM32, CPX_F_APP, &sent.route);
    memcpy(sent.data, bytes, length);
    sent.dataLength = length;
    cpxSendPacketBlocking(&sent);
  }
}

static void takePacket(void) {
  // What cannot be the STM32's (CPX carries packets of WiFi hosts as well) is counted as refused.
  const bool ours = received.route.source == CPX_T_STM32 && received.dataLength <= EDGE_LINK_MAX_BYTES;
  request.length = ours ? received.dataLength : 0;
  request.replyLength = 0;
  memcpy(request.bytes, received.data, request.length);
  if (haveCluster) {
    onCluster(takeOnCluster);
  } else {
    request.replyLength = linkReceiverTake(&refusing, request.bytes, request.length, request.reply);
  }
  send(request.reply, request.replyLength);
}

/** Says on the console what was noted, each once. */
static void tellNotes(void) {
  static const char *const words[NOTES] = {
      [NOTE_CONTROLLER_CLOCK] = "the controller's clock is refused",
      [NOTE_CLUSTER_CLOCK] = "the cluster's clock is refused, it stays at 50 MHz",
      [NOTE_CLUSTER_CLOSED] = "the cluster does not open, the STM32 computes",
      [NOTE_CLUSTER_TASK] = "the cluster takes no task, the STM32 computes",
  };
  for (int i = 0; i < NOTES; i++) {
    if (noted[i]) {
      noted[i] = false;
      cpxPrintToConsole(LOG_TO_CRTP, "AirTouch: %s\n", words[i]);
    }
  }
}

/** Says on the console which networks there are, and which session it is, once for each. */
static void tellSession(const linkReceiver_t *receiver) {
  static bool greeted;
  static uint8_t told;
  if (!greeted) {
    greeted = true;
    cpxPrintToConsole(LOG_TO_CRTP, "AirTouch: %d networks, best %.8s, paper %.8s, paper-stream %.8s\n", (int)networks,
                      AIRTOUCH_STREAM_SHA256, AIRTOUCH_MODEL_SHA256, AIRTOUCH_ROLLING_SHA256);
  }
  if (receiver->session != told) {
    told = receiver->session;
    cpxPrintToConsole(LOG_TO_CRTP, "AirTouch: session %u, model %s, cluster %u MHz\n", told,
                      receiver->mismatch ? "refused" : "known", haveCluster ? clusterMHz : 0);
  }
}

static void heartbeatTask(void *unused) {
  static uint8_t beat[EDGE_LINK_MAX_BYTES];
  (void)unused;
  while (1) {
    vTaskDelay(HEARTBEAT_MS / portTICK_PERIOD_MS);
    xSemaphoreTake(turn, portMAX_DELAY);
    const uint32_t uptime = xTaskGetTickCount() * portTICK_PERIOD_MS;
    const uint16_t length =
        haveCluster ? gap8CoreHeartbeat(&core, uptime, beat) : linkReceiverHeartbeat(&refusing, uptime, beat);
    if (length > 0) {  // the STM32 is there
      tellNotes();
      tellSession(haveCluster ? &core.receiver : &refusing);
      send(beat, length);
    }
    xSemaphoreGive(turn);
  }
}

static bool openCluster(void) {
  static struct pi_cluster_conf conf;
  pi_cluster_conf_init(&conf);
  conf.id = 0;
  pi_open_from_conf(&cluster, &conf);
  if (pi_cluster_open(&cluster) != 0) {
    noted[NOTE_CLUSTER_CLOSED] = true;
    return false;
  }
  clusterMHz = CLUSTER_HZ / 1000000;
  if (pi_freq_set(PI_FREQ_DOMAIN_CL, CLUSTER_HZ) != 0) {
    pi_freq_set(PI_FREQ_DOMAIN_CL, SAFE_HZ);  // as the cluster started; nothing is left to do if that fails
    clusterMHz = SAFE_HZ / 1000000;
    noted[NOTE_CLUSTER_CLOCK] = true;
  }
  return true;
}

static void start(void) {
  pi_bsp_init();
  cpxInit();
  cpxEnableFunction(CPX_F_APP);
  turn = xSemaphoreCreateBinaryStatic(&turnMemory);
  xSemaphoreGive(turn);
  linkReceiverInit(&refusing, NULL, 0);
  noted[NOTE_CONTROLLER_CLOCK] = pi_freq_set(PI_FREQ_DOMAIN_FC, FC_HZ) != 0;
  haveCluster = openCluster();
  if (haveCluster) {
    onCluster(initOnCluster);
  }
  xTaskCreateStatic(heartbeatTask, "heartbeat", STACK_WORDS, NULL, tskIDLE_PRIORITY + 1, heartbeatStack,
                    &heartbeatMemory);
  while (1) {
    cpxReceivePacketBlocking(CPX_F_APP, &received);
    xSemaphoreTake(turn, portMAX_DELAY);
    takePacket();
    xSemaphoreGive(turn);
  }
}

int main(void) { return pmsis_kickoff((void *)start); }
