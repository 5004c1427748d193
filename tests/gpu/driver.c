/* Stands in for CUDA's driver library, libcuda.so: a GPU whose memory is the host's.
 *
 * It has what Taichi 1.7.4 looks up. Kernels come as PTX; a loader, given by the host program, makes
 * them functions that run every thread in turn, so a launch is over when it returns and there is
 * never anything to wait for. Every call is written to a log all the same, a line with its name and
 * its bytes where it has any: it is what a real GPU would have been asked to do.
 */
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define ALIGNMENT 4096 /* of memory, in bytes: CUDA promises less, Taichi relies on it */
#define MEMORY ((size_t)8 << 30) /* in bytes, that it claims to have */
#define MOST_TENSORS 32 /* arguments of one launch */

enum { SUCCESS = 0, INVALID_VALUE = 1, OUT_OF_MEMORY = 2, NOT_FOUND = 500, NOT_SUPPORTED = 801 };
typedef int Result;
typedef void (*Kernel)(uint32_t grid, uint32_t block, void **arguments);
typedef Kernel (*Loader)(const char *ptx, const char *name);

/* --- For the host program ------------------------------------------------------------------- */

static Loader load;
static const void *tensors[MOST_TENSORS];
static size_t tensor_count;
static char *log_text;
static size_t log_size;

/* Who makes kernels; must be known before the first. */
void stand_in_connect(Loader loader) { load = loader; }

/* Adds a line to the log. */
void stand_in_note(const char *line) {
  size_t length = strlen(line);
  char *longer = realloc(log_text, log_size + length + 2);
  if (!longer) abort();
  log_text = longer;
  memcpy(log_text + log_size, line, length);
  memcpy(log_text + log_size + length, "\n", 2);
  log_size += length + 1;
}

/* All lines so far. */
const char *stand_in_log(void) { return log_text ? log_text : ""; }

/* Forgets which tensors lie on the GPU: those of the last launch may be gone. */
void stand_in_forget_tensors(void) { tensor_count = 0; }

/* A tensor at this address, an argument of the next launch, lies on the GPU. */
void stand_in_tensor(const void *address) {
  if (tensor_count == MOST_TENSORS) abort();
  tensors[tensor_count++] = address;
}

static void note_bytes(const char *name, size_t bytes) {
  char line[96];
  snprintf(line, sizeof line, "%s %zu", name, bytes);
  stand_in_note(line);
}

#define NOTE stand_in_note(__func__)
#define NOTE_BYTES(bytes) note_bytes(__func__, bytes)

/* --- The device ----------------------------------------------------------------------------- */

static void *current_context;
static char thing; /* contexts and pools are its address: nobody looks into them */

Result cuInit(unsigned flags) { return NOTE, (void)flags, SUCCESS; }
Result cuDriverGetVersion(int *version) { return NOTE, *version = 12040, SUCCESS; }
Result cuDeviceGetCount(int *count) { return NOTE, *count = 1, SUCCESS; }
Result cuDeviceGet(int *device, int ordinal) { return NOTE, *device = ordinal, SUCCESS; }

Result cuGetErrorName(Result error, const char **name) {
  return (void)error, *name = "error of the stand-in for CUDA", SUCCESS;
}

Result cuGetErrorString(Result error, const char **text) {
  return (void)error, *text = "see driver.c", SUCCESS;
}

Result cuDeviceGetName(char *name, int size, int device) {
  NOTE, (void)device;
  snprintf(name, (size_t)size, "stand-in");
  return SUCCESS;
}

/* Few multiprocessors, so that threads of large batches must take several worlds each. */
Result cuDeviceGetAttribute(int *value, int attribute, int device) {
  NOTE, (void)device;
  switch (attribute) {
    case 2: *value = 1024; break;   /* most threads of a block */
    case 16: *value = 8; break;     /* multiprocessors */
    case 75: *value = 9; break;     /* compute capability 9.0 */
    case 76: *value = 0; break;
    case 97: *value = 49152; break; /* shared memory of a block */
    case 106: *value = 32; break;   /* most blocks of a multiprocessor */
    case 115: *value = 1; break;    /* has pools of memory */
    default: return INVALID_VALUE;
  }
  return SUCCESS;
}

Result cuDevicePrimaryCtxRetain(void **context, int device) {
  return NOTE, (void)device, *context = &thing, SUCCESS;
}

Result cuCtxGetCurrent(void **context) { return NOTE, *context = current_context, SUCCESS; }
Result cuCtxSetCurrent(void *context) { return NOTE, current_context = context, SUCCESS; }

Result cuDeviceGetDefaultMemPool(void **pool, int device) {
  return NOTE, (void)device, *pool = &thing, SUCCESS;
}

Result cuMemPoolSetAttribute(void *pool, int attribute, void *value) {
  return NOTE, (void)pool, (void)attribute, (void)value, SUCCESS;
}

Result cuStreamSynchronize(void *stream) { return NOTE, (void)stream, SUCCESS; }

/* --- Memory --------------------------------------------------------------------------------- */

/* Fresh memory of a GPU is not zero; a pattern shows what relies on it. */
static Result allocate(void **address, size_t bytes) {
  size_t whole = (bytes + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
  *address = aligned_alloc(ALIGNMENT, whole);
  if (!*address) return OUT_OF_MEMORY;
  memset(*address, 0xA5, whole);
  return SUCCESS;
}

Result cuMemAlloc_v2(void **address, size_t bytes) {
  return NOTE_BYTES(bytes), allocate(address, bytes);
}

Result cuMemAllocAsync(void **address, size_t bytes, void *stream) {
  return NOTE_BYTES(bytes), (void)stream, allocate(address, bytes);
}

Result cuMemFree_v2(void *address) { return NOTE, free(address), SUCCESS; }

Result cuMemFreeAsync(void *address, void *stream) {
  return NOTE, (void)stream, free(address), SUCCESS;
}

Result cuMemGetInfo_v2(size_t *available, size_t *total) {
  return NOTE, *available = *total = MEMORY, SUCCESS;
}

Result cuMemcpyDtoH_v2(void *to, const void *from, size_t bytes) {
  return NOTE_BYTES(bytes), memcpy(to, from, bytes), SUCCESS;
}

Result cuMemcpyHtoD_v2(void *to, const void *from, size_t bytes) {
  return NOTE_BYTES(bytes), memcpy(to, from, bytes), SUCCESS;
}

Result cuMemcpyDtoHAsync_v2(void *to, const void *from, size_t bytes, void *stream) {
  return NOTE_BYTES(bytes), (void)stream, memcpy(to, from, bytes), SUCCESS;
}

Result cuMemcpyHtoDAsync_v2(void *to, const void *from, size_t bytes, void *stream) {
  return NOTE_BYTES(bytes), (void)stream, memcpy(to, from, bytes), SUCCESS;
}

Result cuMemsetD8_v2(void *address, unsigned char value, size_t bytes) {
  return NOTE_BYTES(bytes), memset(address, value, bytes), SUCCESS;
}

/* Taichi asks where the tensors of a launch lie, and copies those of the host there and back. */
Result cuPointerGetAttribute(uint32_t *value, int attribute, const void *address) {
  enum { MEMORY_TYPE = 2, ON_HOST = 1, ON_DEVICE = 2 };
  NOTE;
  if (attribute != MEMORY_TYPE) return INVALID_VALUE;
  *value = ON_HOST;
  for (size_t i = 0; i < tensor_count; i++)
    if (tensors[i] == address) *value = ON_DEVICE;
  return SUCCESS;
}

/* --- Kernels -------------------------------------------------------------------------------- */

Result cuModuleLoadDataEx(void **module, const char *ptx, unsigned count, void *options,
                          void *values) {
  NOTE, (void)count, (void)options, (void)values;
  *module = strdup(ptx); /* the loader translates what is asked for later */
  return *module ? SUCCESS : OUT_OF_MEMORY;
}

Result cuModuleGetFunction(Kernel *kernel, void *module, const char *name) {
  NOTE;
  *kernel = load(module, name);
  return *kernel ? SUCCESS : NOT_FOUND;
}

Result cuLaunchKernel(Kernel kernel, uint32_t grid_x, uint32_t grid_y, uint32_t grid_z,
                      uint32_t block_x, uint32_t block_y, uint32_t block_z, uint32_t shared,
                      void *stream, void **arguments, void **extra) {
  NOTE, (void)shared, (void)stream, (void)extra;
  if (grid_y != 1 || grid_z != 1 || block_y != 1 || block_z != 1) return NOT_SUPPORTED;
  kernel(grid_x, block_x, arguments);
  return SUCCESS;
}

/* --- Looked up by Taichi, never called here ------------------------------------------------- */

#define UNUSED(name) \
  Result name(void) { return NOTE, NOT_SUPPORTED; }

UNUSED(cuCtxCreate_v2)
UNUSED(cuCtxSetLimit)
UNUSED(cuEventCreate)
UNUSED(cuEventDestroy)
UNUSED(cuEventElapsedTime)
UNUSED(cuEventRecord)
UNUSED(cuEventSynchronize)
UNUSED(cuExternalMemoryGetMappedBuffer)
UNUSED(cuExternalMemoryGetMappedMipmappedArray)
UNUSED(cuFuncGetAttribute)
UNUSED(cuFuncSetAttribute)
UNUSED(cuImportExternalMemory)
UNUSED(cuImportExternalSemaphore)
UNUSED(cuMemAdvise)
UNUSED(cuMemAllocManaged)
UNUSED(cuMemcpyDtoD_v2)
UNUSED(cuMemsetD32_v2)
UNUSED(cuMipmappedArrayGetLevel)
UNUSED(cuOccupancyMaxActiveBlocksPerMultiprocessor)
UNUSED(cuSignalExternalSemaphoresAsync)
UNUSED(cuStreamCreate)
UNUSED(cuSurfObjectCreate)
UNUSED(cuWaitExternalSemaphoresAsync)
