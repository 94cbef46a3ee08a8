// As much of PMSIS (gap_sdk, FreeRTOS) as gap8/app/src/main.c uses: enough to compile it, and with runtime.c to run it.
#pragma once

#include <stdint.h>
#include <stddef.h>
#include <string.h>

#ifdef __ELF__
#define PI_CL_L1 __attribute__((section(".l1cluster_g")))
#else
#define PI_CL_L1
#endif
#define portMAX_DELAY 0xffffffffu
#define portTICK_PERIOD_MS 1
#define tskIDLE_PRIORITY 0

typedef enum { PI_FREQ_DOMAIN_FC = 0, PI_FREQ_DOMAIN_CL = 1 } pi_freq_domain_e;
typedef uint32_t TickType_t;
typedef uint32_t StackType_t;
typedef void *SemaphoreHandle_t;
typedef void *TaskHandle_t;
typedef struct {
  void *memory[40];
} StaticTask_t;
typedef struct {
  void *memory[20];
} StaticSemaphore_t;
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
int32_t pi_freq_set(pi_freq_domain_e domain, uint32_t hertz);
int pmsis_kickoff(void *entry);
void vTaskDelay(TickType_t ticks);
TickType_t xTaskGetTickCount(void);
SemaphoreHandle_t xSemaphoreCreateBinaryStatic(StaticSemaphore_t *memory);
int xSemaphoreGive(SemaphoreHandle_t semaphore);
int xSemaphoreTake(SemaphoreHandle_t semaphore, TickType_t ticks);
TaskHandle_t xTaskCreateStatic(void (*task)(void *), const char *name, uint32_t words, void *argument,
                               uint32_t priority, StackType_t *stack, StaticTask_t *memory);
