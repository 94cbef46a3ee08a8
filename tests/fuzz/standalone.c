// Runs a target without libFuzzer: every file of the corpus, then mutations of them from a seed, blindly. It takes
// those of libFuzzer's flags that tools/fuzz.py gives and says how many inputs it ran; the input at which a sanitizer
// or a promise ended the run is written to a file whose name begins with -artifact_prefix=, or not at all without one:
// a replayed file need not be written again.
#include <dirent.h>
#include <signal.h>
#include <unistd.h>

#include "fuzz.h"

#define MAX_INPUTS 20000

void __sanitizer_set_death_callback(void (*callback)(void));  // of every sanitizer's run time

typedef struct {
  uint8_t *bytes;
  size_t size;
} input_t;

static input_t corpus[MAX_INPUTS];
static size_t inputs;
static input_t now;         // what the target is given
static const char *prefix;  // of a finding's path; NULL: none is written
static unsigned long runs, seed = 1, longest = 4096, timeout = 20, executed;
static uint64_t state;

static uint32_t draw(uint32_t limit) {
  state ^= state << 13;
  state ^= state >> 7;
  state ^= state << 17;
  return (uint32_t)((state >> 16) % limit);
}

static void save(void) {
  char path[4096];
  static bool saved;
  if (saved || prefix == NULL || now.bytes == NULL) {
    return;
  }
  saved = true;
  snprintf(path, sizeof path, "%scrash-%lu-%lu", prefix, seed, executed);
  FILE *file = fopen(path, "wb");
  if (file != NULL) {
    fwrite(now.bytes, 1, now.size, file);
    fclose(file);
    fprintf(stderr, "Input written to %s\n", path);
  }
}

static void onSignal(int number) {
  fprintf(stderr, number == SIGALRM ? "one input takes too long\n" : "aborted\n");
  save();
  _exit(1);
}

/** Gives the target exactly as much memory as the input has. */
static void execute(const uint8_t *bytes, size_t size) {
  now.bytes = exactCopy(bytes, size);
  now.size = size;
  if (executed % 64 == 0) {  // of 64 inputs rather than of one: an alarm is a system call
    alarm((unsigned)timeout);
  }
  LLVMFuzzerTestOneInput(now.bytes, size);
  executed++;
  free(now.bytes);
  now.bytes = NULL;
}

static void readFile(const char *path) {
  FILE *file = fopen(path, "rb");
  if (file == NULL) {
    fprintf(stderr, "cannot read %s\n", path);
    exit(2);
  }
  uint8_t *bytes = rubbish(longest, 0);
  const size_t size = fread(bytes, 1, longest, file);
  fclose(file);
  execute(bytes, size);
  if (inputs < MAX_INPUTS) {
    corpus[inputs++] = (input_t){bytes, size};
  } else {
    free(bytes);
  }
}

static int byName(const void *a, const void *b) { return strcmp(*(char *const *)a, *(char *const *)b); }

static void readFolder(const char *path, DIR *folder) {
  static char *names[MAX_INPUTS];
  size_t count = 0;
  for (struct dirent *entry = readdir(folder); entry != NULL && count < MAX_INPUTS; entry = readdir(folder)) {
    if (entry->d_name[0] != '.') {
      names[count] = rubbish(strlen(path) + strlen(entry->d_name) + 2, 0);
      sprintf(names[count++], "%s/%s", path, entry->d_name);
    }
  }
  qsort(names, count, sizeof names[0], byName);  // the same order, so the same mutations, on every machine
  for (size_t i = 0; i < count; i++) {
    readFile(names[i]);
    free(names[i]);
  }
}

static void change(uint8_t *bytes, size_t *size) {
  static const uint8_t telling[] = {0, 1, 7, 8, 0x7f, 0x80, 0xfe, 0xff};
  const uint32_t at = draw((uint32_t)*size + 1);
  const uint32_t span = 1 + draw(8);
  switch (draw(7)) {
    case 0:
    case 1:
      if (at < *size) {
        bytes[at] ^= (uint8_t)(1u << draw(8));
      }
      break;
    case 2:
      if (at < *size) {
        bytes[at] = (uint8_t)draw(256);
      }
      break;
    case 3:
      if (at < *size) {
        bytes[at] = telling[draw(sizeof telling)];
      }
      break;
    case 4:
      if (at + span <= *size) {
        memmove(bytes + at, bytes + at + span, *size - at - span);
        *size -= span;
      }
      break;
    case 5:
      if (*size + span <= longest) {
        memmove(bytes + at + span, bytes + at, *size - at);
        for (uint32_t i = 0; i < span; i++) {
          bytes[at + i] = (uint8_t)draw(256);
        }
        *size += span;
      }
      break;
    default:
      if (inputs > 0) {  // the rest of another input
        const input_t *other = &corpus[draw((uint32_t)inputs)];
        const uint32_t from = draw((uint32_t)other->size + 1);
        const size_t room = longest - at, rest = other->size - from;
        *size = at + (rest < room ? rest : room);
        memcpy(bytes + at, other->bytes + from, *size - at);
      }
      break;
  }
}

static void mutate(void) {
  uint8_t *bytes = rubbish(longest, 0);
  while (executed < runs) {
    size_t size = 0;
    if (inputs > 0) {
      const input_t *one = &corpus[draw((uint32_t)inputs)];
      size = one->size;
      memcpy(bytes, one->bytes, size);
    }
    for (uint32_t i = 1 + draw(6); i > 0; i--) {
      change(bytes, &size);
    }
    execute(bytes, size);
  }
  free(bytes);
}

static bool readFlag(const char *word, const char *name, unsigned long *value) {
  const size_t length = strlen(name);
  if (strncmp(word, name, length) != 0) {
    return false;
  }
  *value = strtoul(word + length, NULL, 10);
  return true;
}

int main(int argc, char **argv) {
  __sanitizer_set_death_callback(save);
  signal(SIGABRT, onSignal);
  signal(SIGALRM, onSignal);
  for (int i = 1; i < argc; i++) {
    if (!readFlag(argv[i], "-runs=", &runs) && !readFlag(argv[i], "-seed=", &seed) &&
        !readFlag(argv[i], "-max_len=", &longest) && !readFlag(argv[i], "-timeout=", &timeout) &&
        strncmp(argv[i], "-artifact_prefix=", 17) == 0) {
      prefix = argv[i] + 17;
    }
  }
  state = seed * UINT64_C(0x9e3779b97f4a7c15) + 1;
  for (int i = 1; i < argc; i++) {
    if (argv[i][0] != '-') {
      DIR *folder = opendir(argv[i]);
      if (folder != NULL) {
        readFolder(argv[i], folder);
        closedir(folder);
      } else {
        readFile(argv[i]);
      }
    }
  }
  mutate();
  for (size_t i = 0; i < inputs; i++) {
    free(corpus[i].bytes);
  }
  fprintf(stderr, "stat::number_of_executed_units: %lu\n", executed);
  return 0;
}
