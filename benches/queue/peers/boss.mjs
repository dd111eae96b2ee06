// Times pg-boss with jobs that do nothing: node boss.mjs URL JOBS BATCH LOOPS
import { PgBoss } from 'pg-boss'

const [connectionString, jobs, batchSize, loops] = [process.argv[2], +process.argv[3], +process.argv[4], +process.argv[5]]
const boss = new PgBoss({ connectionString, max: loops + 4 })
boss.on('error', error => console.error(error.message))
await boss.start()
await boss.createQueue('nothing')
const begin = performance.now()
for (let first = 0; first < jobs; first += 2000) {
  const length = Math.min(2000, jobs - first)
  await boss.insert('nothing', Array.from({ length }, (_, i) => ({ data: { number: first + i } })))
}
const added = performance.now()
let done = 0
const work = async () => {
  for (;;) {
    const fetched = await boss.fetch('nothing', { batchSize })
    if (fetched.length === 0) return
    await boss.complete('nothing', fetched.map(job => job.id))
    done += fetched.length
  }
}
await Promise.all(Array.from({ length: loops }, work))
const ended = performance.now()
const rate = (count, from, to) => Math.round(count / (to - from) * 1000)
console.log(`pg-boss, ${loops} loops, ${batchSize} a fetch: ${rate(jobs, begin, added)} added/s, ${rate(done, added, ended)} finished/s`)
process.exit(0)
