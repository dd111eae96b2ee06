// Times graphile-worker with jobs that do nothing: node graphile.mjs URL JOBS BATCH
import { Logger, makeWorkerUtils, run } from 'graphile-worker'

const [connectionString, jobs, batch] = [process.argv[2], +process.argv[3], +process.argv[4]]
const utils = await makeWorkerUtils({ connectionString })
await utils.migrate()
const begin = performance.now()
for (let first = 0; first < jobs; first += 5000) {
  const length = Math.min(5000, jobs - first)
  await utils.addJobs(Array.from({ length }, (_, i) => ({ identifier: 'nothing', payload: { number: first + i } })))
}
const added = performance.now()
let done = 0
let finish
const finished = new Promise(resolve => { finish = resolve })
const nothing = async () => { if (++done === jobs) finish() }
const batched = batch > 1 ? { localQueue: { size: batch }, completeJobBatchDelay: 0, failJobBatchDelay: 0 } : {}
// Its default writes a line for each job.
const logger = new Logger(() => () => {})
const worker = { connectionString, concurrentJobs: 24, maxPoolSize: 25, pollInterval: 500, ...batched }
const runner = await run({ preset: { worker: { ...worker, logger } }, noHandleSignals: true, taskList: { nothing } })
await finished
const ended = performance.now()
await runner.stop()
await utils.release()
const rate = (from, to) => Math.round(jobs / (to - from) * 1000)
console.log(`graphile-worker, ${batch} a fetch: ${rate(begin, added)} added/s, ${rate(added, ended)} finished/s`)
process.exit(0)
