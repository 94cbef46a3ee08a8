// As much of PMSIS (gap_sdk, FreeRTOS) as gap8/app/src/main.c uses: enough to compile it, not to run it.
#pragma once

#include <stdint.h>
#include <stddef.h>
#include <string.h>

#define PI_CL_L1 __attribute__((section(".l1cluster_g")))
#define PI_FREQ_DOMAIN_FC 0
#define PI_FREQ_DOMAIN_CL 1
#define configMINIMAL_STACK_SIZE 256
#define portMAX_DELAY 0xffffffffu
#define portTICK_PERIOD_MS 1
#define tskIDLE_PRIORITY 0
#define pdPASS 1

typedef uint32_t TickType_t;
typedef void *SemaphoreHandle_t;
struct pi_device {
  void *config;
};
struct pi_cluster_conf {
  int id;
};
struct pi_cluster_task {
  void (*entry)(void *);
  void *arg;
  void *stacks;
  uint32_t stack_size;
  uint32_t slave_stack_size;
};

uint32_t pi_core_id(void);
void pi_cl_team_fork(int cores, void (*entry)(void *), void *argument);
void pi_cl_team_barrier(int unused);
struct pi_cluster_task *pi_cluster_task(struct pi_cluster_task *task, void (*entry)(void *), void *argument);
int pi_cluster_send_task_to_cl(struct pi_device *device, struct pi_cluster_task *task);
void pi_cluster_conf_init(struct pi_cluster_conf *conf);
void pi_open_from_conf(struct pi_device *device, void *conf);
int pi_cluster_open(struct pi_device *device);
int pi_freq_set(int domain, uint32_t hertz);
void pmsis_exit(int code);
int pmsis_kickoff(void *entry);
void vTaskDelay(TickType_t ticks);
TickType_t xTaskGetTickCount(void);
SemaphoreHandle_t xSemaphoreCreateBinary(void);
int xSemaphoreGive(SemaphoreHandle_t semaphore);
int xSemaphoreTake(SemaphoreHandle_t semaphore, TickType_t ticks);
int xTaskCreate(void (*task)(void *), const char *name, uint16_t words, void *argument, uint32_t priority, void **handle);
