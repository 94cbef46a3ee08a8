// The app on the GAP8: PMSIS with FreeRTOS, CPX from and to the STM32, networks on the cluster. All that it does with
// a packet is in gap8_core.h; this gives it the cluster, a clock and the wire.
#include "bsp/bsp.h"
#include "pmsis.h"

#include "cpx.h"
#include "gap8_core.h"
#include "l1_models.h"

#define CORES 8
#define FC_HZ 50000000
#define CLUSTER_HZ 175000000
#define HEARTBEAT_MS 500
#define STACK_WORDS (4 * configMINIMAL_STACK_SIZE)
#define FIRST_CORE_STACK 2048  // bytes
#define OTHER_CORE_STACK 2048

/** What the cluster is asked to do: a packet, and room for the reply. In L2, which both sides see. */
typedef struct {
  uint16_t length;
  uint16_t replyLength;
  uint8_t bytes[EDGE_LINK_MAX_BYTES];
  uint8_t reply[EDGE_LINK_MAX_BYTES];
} request_t;

static PI_CL_L1 gap8Core_t core;
static PI_CL_L1 uint64_t stacks[(FIRST_CORE_STACK + (CORES - 1) * OTHER_CORE_STACK) / 8];
static struct pi_device cluster;
static struct pi_cluster_task clusterTask;
static request_t request;
static CPXPacket_t received;
static CPXPacket_t sent;
static SemaphoreHandle_t turn;  // one task at a time uses the core and sends: CPX packs into one buffer

static void forkTeam(void (*work)(void *argument), void *argument) { pi_cl_team_fork(CORES, work, argument); }

static int32_t coreNumber(void) { return (int32_t)pi_core_id(); }

static void teamBarrier(void *unused) {
  (void)unused;
  pi_cl_team_barrier(0);
}

static PI_CL_L1 gap8Team_t team = {forkTeam, coreNumber, teamBarrier, CORES};

static void initOnCluster(void *unused) {
  (void)unused;
  gap8CoreInit(&core, &gap8L1Stream, &gap8L1Network, &team);
}

static void takeOnCluster(void *unused) {
  (void)unused;
  request.replyLength = gap8CoreTake(&core, request.bytes, request.length, request.reply);
}

/** Runs an entry on the cluster's first core and waits for it. */
static void onCluster(void (*entry)(void *)) {
  pi_cluster_task(&clusterTask, entry, NULL);
  clusterTask.stacks = stacks;
  clusterTask.stack_size = FIRST_CORE_STACK;
  clusterTask.slave_stack_size = OTHER_CORE_STACK;
  pi_cluster_send_task_to_cl(&cluster, &clusterTask);
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
  request.length = received.dataLength;
  if (received.dataLength > EDGE_LINK_MAX_BYTES) {
    request.length = 0;  // counted as refused
  }
  memcpy(request.bytes, received.data, request.length);
  const uint8_t before = core.receiver.session;
  onCluster(takeOnCluster);
  send(request.reply, request.replyLength);
  if (core.receiver.session != before) {
    cpxPrintToConsole(LOG_TO_CRTP, "AirTouch: session %u, %s\n", core.receiver.session,
                      core.receiver.mismatch ? "model refused" : "model known");
  }
}

static void heartbeatTask(void *unused) {
  static uint8_t beat[EDGE_LINK_MAX_BYTES];
  (void)unused;
  while (1) {
    vTaskDelay(HEARTBEAT_MS / portTICK_PERIOD_MS);
    xSemaphoreTake(turn, portMAX_DELAY);
    send(beat, gap8CoreHeartbeat(&core, xTaskGetTickCount() * portTICK_PERIOD_MS, beat));
    xSemaphoreGive(turn);
  }
}

static void openCluster(void) {
  static struct pi_cluster_conf conf;
  pi_cluster_conf_init(&conf);
  conf.id = 0;
  pi_open_from_conf(&cluster, &conf);
  if (pi_cluster_open(&cluster)) {
    cpxPrintToConsole(LOG_TO_CRTP, "AirTouch: the cluster does not open\n");
    pmsis_exit(-1);
  }
  pi_freq_set(PI_FREQ_DOMAIN_CL, CLUSTER_HZ);
}

static void start(void) {
  pi_bsp_init();
  pi_freq_set(PI_FREQ_DOMAIN_FC, FC_HZ);
  cpxInit();
  cpxEnableFunction(CPX_F_APP);
  openCluster();
  onCluster(initOnCluster);
  turn = xSemaphoreCreateBinary();
  xSemaphoreGive(turn);
  cpxPrintToConsole(LOG_TO_CRTP, "AirTouch: best %.8s, paper %.8s\n", AIRTOUCH_STREAM_SHA256, AIRTOUCH_MODEL_SHA256);
  if (xTaskCreate(heartbeatTask, "heartbeat", STACK_WORDS, NULL, tskIDLE_PRIORITY + 1, NULL) != pdPASS) {
    pmsis_exit(-1);
  }
  while (1) {
    cpxReceivePacketBlocking(CPX_F_APP, &received);
    xSemaphoreTake(turn, portMAX_DELAY);
    takePacket();
    xSemaphoreGive(turn);
  }
}

int main(void) { return pmsis_kickoff((void *)start); }
