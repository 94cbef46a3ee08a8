// PMSIS, FreeRTOS and CPX on a desktop, as far as gap8/app/src/main.c goes: for tests/gap8/app/test_gap8_main.py.
// Usage: app [FAULT...]; faults: clock (the cluster's above 50 MHz), controller (its clock), open, task, later (tasks
// after the first). Reads records of 1 byte source, 2 bytes length and the bytes: a packet, or with source 0 half a
// second. Writes a record of 1 byte function, 2 bytes length and the bytes for each packet that the app sends, and an
// empty one of function 0 after each half second. Ends with the input. The cluster's eight cores are threads; a task
// that is told to wait waits for its record.
#include "pmsis.h"

#include <pthread.h>
#include <semaphore.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>

#include "bsp/bsp.h"
#include "cpx.h"

int appMain(void);  // main() of the app, compiled as this

static int faultCount;
static char **faults;
static void (*delayed)(void *);
static pthread_t delayedThread;
static sem_t wake, asleep;
static uint32_t milliseconds;
static pthread_barrier_t meeting;
static __thread uint32_t number;
static void (*job)(void *);
static void *jobArgument;
static bool clusterOpen;
static int clusterTasks;

static bool fails(const char *name) {
  for (int i = 0; i < faultCount; i++) {
    if (strcmp(faults[i], name) == 0) {
      return true;
    }
  }
  return false;
}

static void record(uint8_t kind, const uint8_t *bytes, uint16_t length) {
  const uint8_t head[3] = {kind, (uint8_t)length, (uint8_t)(length >> 8)};
  fwrite(head, 1, sizeof head, stdout);
  fwrite(bytes, 1, length, stdout);
  fflush(stdout);
}

void pi_bsp_init(void) {}

int pmsis_kickoff(void *entry) {
  ((void (*)(void))entry)();
  return 0;
}

int32_t pi_freq_set(pi_freq_domain_e domain, uint32_t hertz) {
  if (domain == PI_FREQ_DOMAIN_FC) {
    return fails("controller") ? -1 : 0;
  }
  return fails("clock") && hertz > 50000000 ? -1 : 0;
}

void pi_cluster_conf_init(struct pi_cluster_conf *conf) { conf->id = 0; }

void pi_open_from_conf(struct pi_device *device, void *conf) { device->config = conf; }

int pi_cluster_open(struct pi_device *device) {
  clusterOpen = device->config != NULL && !fails("open");
  return clusterOpen ? 0 : -11;
}

struct pi_cluster_task *pi_cluster_task(struct pi_cluster_task *task, void (*entry)(void *), void *argument) {
  *task = (struct pi_cluster_task){.entry = entry, .arg = argument};
  return task;
}

int pi_cluster_send_task_to_cl(struct pi_device *device, struct pi_cluster_task *task) {
  (void)device;
  if (!clusterOpen || fails("task") || (fails("later") && clusterTasks > 0)) {
    return -1;
  }
  clusterTasks++;
  memset(task->stacks, 0x55, task->stack_size + 7 * task->slave_stack_size);  // as much as is promised
  task->entry(task->arg);
  return 0;
}

static void *runCore(void *core) {
  number = (uint32_t)(size_t)core;
  job(jobArgument);
  return NULL;
}

void pi_cl_team_fork(int cores, void (*entry)(void *), void *argument) {
  pthread_t threads[8];
  job = entry;
  jobArgument = argument;
  pthread_barrier_init(&meeting, NULL, (unsigned)cores);
  for (long i = 1; i < cores; i++) {
    pthread_create(&threads[i], NULL, runCore, (void *)i);
  }
  runCore((void *)0);
  for (int i = 1; i < cores; i++) {
    pthread_join(threads[i], NULL);
  }
  pthread_barrier_destroy(&meeting);
}

uint32_t pi_core_id(void) { return number; }

void pi_cl_team_barrier(int unused) {
  (void)unused;
  pthread_barrier_wait(&meeting);
}

static void *runDelayed(void *argument) {
  delayed(argument);
  return NULL;
}

TaskHandle_t xTaskCreateStatic(void (*task)(void *), const char *name, uint32_t words, void *argument,
                               uint32_t priority, StackType_t *stack, StaticTask_t *memory) {
  (void)name;
  (void)priority;
  memset(stack, 0x55, words * sizeof *stack);
  delayed = task;
  pthread_create(&delayedThread, NULL, runDelayed, argument);
  sem_wait(&asleep);
  return memory;
}

void vTaskDelay(TickType_t ticks) {
  sem_post(&asleep);
  sem_wait(&wake);
  milliseconds += ticks * portTICK_PERIOD_MS;
}

TickType_t xTaskGetTickCount(void) { return milliseconds / portTICK_PERIOD_MS; }

SemaphoreHandle_t xSemaphoreCreateBinaryStatic(StaticSemaphore_t *memory) {
  _Static_assert(sizeof(sem_t) <= sizeof *memory, "room for a semaphore");
  sem_init((sem_t *)memory, 0, 0);
  return memory;
}

int xSemaphoreGive(SemaphoreHandle_t semaphore) { return sem_post(semaphore) == 0; }

int xSemaphoreTake(SemaphoreHandle_t semaphore, TickType_t ticks) {
  (void)ticks;
  return sem_wait(semaphore) == 0;
}

void cpxInit(void) {}

void cpxEnableFunction(CPXFunction_t function) { (void)function; }

void cpxInitRoute(const CPXTarget_t source, const CPXTarget_t destination, const CPXFunction_t function,
                  CPXRouting_t *route) {
  *route = (CPXRouting_t){.source = source, .destination = destination, .function = function, .lastPacket = true};
}

void cpxReceivePacketBlocking(CPXFunction_t function, CPXPacket_t *packet) {
  (void)function;
  uint8_t head[3];
  while (fread(head, 1, sizeof head, stdin) == sizeof head) {
    const uint16_t length = (uint16_t)(head[1] | head[2] << 8);
    if (head[0] == 0) {
      sem_post(&wake);
      sem_wait(&asleep);  // until it waits again
      record(0, head, 0);
      continue;
    }
    packet->route.source = (CPXTarget_t)head[0];
    packet->dataLength = length;  // lib/cpx computes it from the wire and copies so many, more than there is room for
    const size_t there = length < sizeof packet->data ? length : sizeof packet->data;
    if (fread(packet->data, 1, there, stdin) == there) {
      return;
    }
  }
  exit(0);
}

void cpxSendPacketBlocking(const CPXPacket_t *packet) {
  record((uint8_t)packet->route.function, packet->data, packet->dataLength);
}

void cpxPrintToConsole(CPXConsoleTarget_t target, const char *format, ...) {
  char text[1020];
  va_list list;
  (void)target;
  va_start(list, format);
  const int length = vsnprintf(text, sizeof text, format, list);
  va_end(list);
  record(CPX_F_CONSOLE, (const uint8_t *)text, (uint16_t)length);
}

int main(int argc, char **argv) {
  faultCount = argc - 1;
  faults = argv + 1;
  sem_init(&wake, 0, 0);
  sem_init(&asleep, 0, 0);
  return appMain();
}
